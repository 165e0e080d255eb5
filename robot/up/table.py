"""How the processes of a rig are, as a table for a person. The edge: a terminal."""

from rich.table import Table

from robot.up.clocks import ClockOffset
from robot.up.supervisor import Supervisor

__all__ = ["status_table"]


def status_table(supervisor: Supervisor) -> Table:
    """Return one row a process, those of other machines after our own, and the last thing that happened below."""
    table = Table("node", "process", "rate / target", "late", "age", "memory", "starts", "clock", "is", "last error")
    clocks = {offset.source: offset for offset in supervisor.clocks.offsets()}
    for name, node in supervisor.nodes.items():
        heard, age_s = supervisor.book[name], supervisor.book.age_s(name)
        health = heard.health
        pid = "–" if node.child is None else str(node.child.pid)
        if health is None or age_s is None:
            table.add_row(name, pid, "–", "–", "–", "–", str(node.n_starts), "–", "not heard", "")
            continue
        target = "" if health.target_hz is None else f" / {health.target_hz:.0f}"
        table.add_row(
            name, pid, f"{health.rate_hz:.1f}{target} Hz", f"{health.late_ms:.1f} ms", f"{age_s:.1f} s",
            f"{health.rss_mb:.0f} MB", str(node.n_starts), _clock(clocks.pop(name, None)), health.doing,
            health.last_error[:60],
        )  # fmt: skip
    for name, offset in clocks.items():
        if name not in supervisor.nodes:
            table.add_row(name, "–", "–", "–", "–", "–", "–", _clock(offset), "not ours", "")
    if supervisor.events:
        last = supervisor.events[-1]
        table.caption = f"{last.at_s:.1f} s, {last.node}: {last.what}"
    return table


def _clock(offset: ClockOffset | None) -> str:
    """Return whose clock a process goes by: ours, or how far it is off."""
    if offset is None:
        return "–"
    return "ours" if offset.is_same_clock else f"{offset.offset_ms:+.2f} ± {offset.within_ms:.2f} ms"
