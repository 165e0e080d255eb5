"""The report of a check: one object for a script, a table for a person, a figure of the worst streams."""

from pathlib import Path

import msgspec
from matplotlib.figure import Figure
from rich.console import RenderableType
from rich.markup import escape
from rich.table import Table

from robot.bench import BenchReport
from sim_twin.checking.check import Setup, rerun
from sim_twin.checking.mutations import Outcome
from sim_twin.checking.tally import Breach, LimitRow

__all__ = ["CheckReport", "MutationReport", "as_json", "draw", "shown", "shown_mutations"]

N_DRAWN = 4
LIMIT_WIDTH = 20
"""Of the column that names limits: whatever the terminal's width, one reads which it is."""


class CheckReport(BenchReport, frozen=True, kw_only=True):
    """What a check found; a bench's report and what is needed to run a stream again."""

    rig: str
    profile: str
    seed: int
    full: bool
    streams_by_plant: dict[str, int]
    limits: tuple[LimitRow, ...]
    breaches: tuple[Breach, ...]

    @property
    def is_passed(self) -> bool:
        """Whether no limit was broken."""
        return all(result.ok for result in self.results)


class MutationReport(BenchReport, frozen=True, kw_only=True):
    """What weakening each limit alone by 5 % came to."""

    rig: str
    profile: str
    seed: int
    outcomes: tuple[Outcome, ...]


def shown_mutations(report: MutationReport) -> tuple[RenderableType, ...]:
    """Return a table of one row a limit."""
    table = Table(
        "limit", "margin", "margin, 5 % weaker", "held", "told", "by",
        title=f"each limit weakened alone: rig {report.rig}, profile {report.profile}, seed {report.seed}",
    )  # fmt: skip
    for row in report.outcomes:
        by = f"{row.family} {row.number}" if row.is_caught else ""
        table.add_row(
            row.limit, f"{row.true_margin_share:+.1%}", f"{row.weakened_margin_share:+.1%}",
            "yes" if row.is_held else "NO", "yes" if row.is_caught else "NO", by,
        )  # fmt: skip
    return (table,)


def shown(report: CheckReport) -> tuple[RenderableType, ...]:
    """Return a table of one row a limit, the worst first, and the sums."""
    table = Table(title=f"teleop check: rig {report.rig}, profile {report.profile}, seed {report.seed}")
    table.add_column("limit", overflow="fold", min_width=LIMIT_WIDTH)
    for name in ("worst margin", "value", "violations"):
        table.add_column(name, justify="right", overflow="fold")
    for name in ("stream", "family", "plant", "where"):
        table.add_column(name, overflow="fold")
    for row in report.limits:
        style = "red" if row.violations else None
        where = f"{row.at_s:.2f} s {row.detail}".strip()
        table.add_row(
            escape(row.limit), f"{row.worst_margin_share:+.1%}", f"{row.value:.4g}", str(row.violations),
            str(row.stream), row.family, row.plant, escape(where), style=style,
        )  # fmt: skip
    sums = ", ".join(f"{r.name} {r.value:.6g}" + (f" {r.unit}" if r.unit != "1" else "") for r in report.results)
    hint = () if report.is_passed else ("a stream alone: the same command with --stream N",)
    return table, f"{sums} in {report.seconds:.0f} s", *hint


def draw(setup: Setup, report: CheckReport, path: Path, *, about: str = "") -> None:
    """Draw distance to limit over time for the streams that came nearest to theirs, or broke them."""
    has_course = [row for row in report.limits if not row.limit.startswith(("force:", "meeting_", "contact", "stop"))]
    chosen: list[LimitRow] = []
    for row in has_course:
        if len(chosen) < N_DRAWN and row.stream not in {c.stream for c in chosen}:
            chosen.append(row)
    figure = Figure(figsize=(9.0, 2.2 * max(len(chosen), 1)), layout="constrained")
    if about:
        figure.suptitle(about, fontsize=9)
    for axes, row in zip(figure.subplots(max(len(chosen), 1), 1, squeeze=False)[:, 0], chosen, strict=False):
        _, ring = rerun(setup, row.stream)
        course = ring.course
        assert course is not None, "a stream was run"
        for margin in ring.margins():
            times = [k * margin.dt_s for k in range(len(margin.least))]
            is_it = margin.limit == row.limit
            axes.plot(
                times, margin.least, lw=1.4 if is_it else 0.5, color="tab:red" if is_it else "0.7", zorder=2 + is_it
            )
        axes.axhline(0.0, color="k", lw=0.8)
        axes.set_ylim(min(-0.1, max(row.worst_margin_share * 1.2, -2.0)), 1.0)
        axes.set_title(f"stream {row.stream}, {row.family}, {row.plant}: {row.limit}", fontsize=9)
        axes.set_ylabel("margin, share of limit", fontsize=8)
    figure.get_axes()[-1].set_xlabel("time / s")
    figure.savefig(path, dpi=120)


def as_json(report: CheckReport) -> str:
    """Return the report as one JSON object."""
    return msgspec.json.encode(report).decode()
