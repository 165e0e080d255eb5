"""What a run bears, as figures: success by goal and case, before and after going on to learn, and the graph. Pure."""

from collections.abc import Sequence

import msgspec

from learning.report import Count, count
from learning.robustness.cases import Case
from learning.rows import EvaluationRow, GraphRow
from learning.run_folder import GoalInfo

__all__ = ["Bearing", "CaseResult", "Looks", "Plan", "Robustness", "bearing_of"]


class Plan(msgspec.Struct, frozen=True, kw_only=True):
    """What is tried on which checkpoint of which run."""

    format: int = 1
    learner: str
    scenario: str
    run_seed: int
    config_sha256: str
    """Of the run."""
    n_done: int
    """Epochs that the run had done."""
    n_tests: int
    """Test epochs a goal and case."""
    n_more: int
    """Epochs that it goes on to learn under each case."""
    seed: int
    """Root seed of test layouts and of what is learnt on."""


class CaseResult(msgspec.Struct, frozen=True, kw_only=True):
    """What one case came to, row by row."""

    case: str
    before: tuple[EvaluationRow, ...]
    """Learning off, a row a goal."""
    after: tuple[EvaluationRow, ...]
    """The same after going on to learn under it; none where that was not asked for."""
    looks: tuple[GraphRow, ...]
    """At the graph meanwhile."""
    n_void: int
    """Learning epochs that were cut short."""


class Looks(msgspec.Struct, frozen=True, kw_only=True):
    """At the graph, while it went on to learn."""

    n: int
    n_right: int
    """Looks at which it said the same as the rules of every goal in every goal-state that can be reached."""
    n_wrong_last: int
    """Predictions that were wrong at the last one."""
    n_cases: int


class Bearing(msgspec.Struct, frozen=True, kw_only=True):
    """What one case came to. Shares are of test epochs, those cut short among them, with Wilson's 95 % interval."""

    case: str
    says: str
    before: tuple[Count, ...]
    """A goal each, learning off."""
    after: tuple[Count, ...]
    graph_before: tuple[int, int] | None
    """Predictions that were wrong, and how many there were; None where no graph is learnt."""
    looks: Looks | None


class Robustness(msgspec.Struct, frozen=True, kw_only=True):
    """What a run bears."""

    plan: Plan
    goals: tuple[GoalInfo, ...]
    cases: tuple[Bearing, ...]


def bearing_of(case: Case, result: CaseResult) -> Bearing:
    """Return what a case came to, as figures."""
    return Bearing(
        case=case.name,
        says=case.says,
        before=_counts(result.before),
        after=_counts(result.after),
        graph_before=_graph(result.before),
        looks=_looks(result.looks),
    )


def _counts(rows: Sequence[EvaluationRow]) -> tuple[Count, ...]:
    return tuple(count(row.n_successes, row.n_all) for row in sorted(rows, key=lambda row: row.goal))


def _graph(rows: Sequence[EvaluationRow]) -> tuple[int, int] | None:
    compared = [(row.graph_wrong, row.graph_cases) for row in rows]
    known = [(wrong, cases) for wrong, cases in compared if wrong is not None and cases is not None]
    return (sum(wrong for wrong, _ in known), sum(cases for _, cases in known)) if known else None


def _looks(rows: Sequence[GraphRow]) -> Looks | None:
    if not rows:
        return None
    last = rows[-1]
    n_right = sum(row.n_wrong == 0 for row in rows)
    return Looks(n=len(rows), n_right=n_right, n_wrong_last=last.n_wrong, n_cases=last.n_cases)
