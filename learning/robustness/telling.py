"""What a run bears, as a table for a person."""

from collections.abc import Sequence

from rich import box
from rich.table import Table
from rich.text import Text

from learning.report import Count, count
from learning.robustness.result import Bearing, Robustness

__all__ = ["robustness_table"]


def robustness_table(told: Robustness) -> Table:
    """Return a row a case: achieved test epochs a goal, before and, below it, after going on to learn; the graph."""
    plan = told.plan
    table = Table(
        box=box.SIMPLE_HEAD, pad_edge=False,
        title=f"{plan.learner}, seed {plan.run_seed}, after epoch {plan.n_done}",
        caption=f"test epochs achieved of {plan.n_tests} a goal (95 % interval of {plan.n_tests} of {plan.n_tests}: "
        f"{_interval(told)}); below, after {plan.n_more} more epochs under the same",
    )  # fmt: skip
    table.add_column("case")
    for goal in told.goals:
        table.add_column(goal.name.replace("_", "\n"), justify="right")
    table.add_column("graph wrong")
    for case in told.cases:
        table.add_row(Text(case.says), *_cells(case), _graph(case), end_section=True)
    return table


def _interval(told: Robustness) -> str:
    best = count(told.plan.n_tests, told.plan.n_tests)
    return f"{best.share_low:.0%} to {best.share_high:.0%}"


def _cells(case: Bearing) -> list[str]:
    after: Sequence[Count | None] = case.after or (None,) * len(case.before)
    return [
        f"{then.n}/{then.of}" + ("" if now is None else f"\n{now.n}/{now.of}")
        for then, now in zip(case.before, after, strict=True)
    ]


def _graph(case: Bearing) -> str:
    before = "–" if case.graph_before is None else f"{case.graph_before[0]} of {case.graph_before[1]}"
    looks = case.looks
    if looks is None:
        return before
    return f"{before}\n{looks.n_wrong_last} of {looks.n_cases}, right at {looks.n_right} of {looks.n} looks"
