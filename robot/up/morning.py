"""What a person wants to read in the morning, of a run that nobody attended. Pure."""

from collections.abc import Iterable

from robot.up.night import Stopped
from robot.up.summary import Summary, Worst

__all__ = ["morning_report"]

VERDICTS = {
    Worst.NOTHING: "nothing went wrong",
    Worst.MENDED: "something went wrong and was mended",
    Worst.FAILED: "it failed",
}
MOST_EVENTS = 40


def morning_report(summary: Summary, stops: Iterable[Stopped], *, n_stops: int, why_over: str | None) -> str:
    """Return it as Markdown: how it ended, the stops with their reasons, who was started again, what grew."""
    hours = summary.seconds / 3600.0
    lines = [
        f"# {summary.rig}: {hours:.1f} h, {VERDICTS[Worst(summary.exit_code)]}", "",
        f"* ended: {why_over or 'as it was asked to, or its job was done'}",
        f"* stops: {n_stops}, {n_stops / hours if hours else 0.0:.2f} an hour",
        f"* logs: {summary.logs}", "", "| process | starts | memory at most | grown | late at most | last error |",
        "|---|---|---|---|---|---|",
    ]  # fmt: skip
    lines += [
        f"| {n.name} | {n.n_starts} | {n.most_mb:.0f} MB | {n.grown_mb:.0f} MB | {n.most_late_ms:.0f} ms | "
        f"{n.last_error[:80].replace('|', '/')} |"
        for n in summary.nodes
    ]
    lines += ["", "## Stops", ""]
    told = list(stops)
    lines += [f"* {stop.at_s:.0f} s: {stop.reason}" for stop in told] or ["none"]
    lines += ["", f"## The last {MOST_EVENTS} events", ""]
    lines += [f"* {event.at_s:.1f} s, {event.node}: {event.what}" for event in summary.events[-MOST_EVENTS:]]
    return "\n".join(lines) + "\n"
