"""What the figures of a run mean: mastered, learnt, recovered, optimal, right. Pure."""

import itertools
from collections.abc import Callable, Sequence
from statistics import fmean

import msgspec

from learning.interfaces import GoalState
from learning.rows import EvaluationRow, GoalRow, GraphRow

__all__ = [
    "AddedGoal",
    "Allowed",
    "Era",
    "EraSummary",
    "Summary",
    "due_evaluations",
    "due_graph_looks",
    "eras",
    "first_running",
    "graph_errors",
    "is_mastered",
    "optimal_trials",
    "reachable_states",
    "summarise",
]

Allowed = Callable[[int, GoalState], bool]
"""Whether a goal can come about in a goal-state, under the rules in force."""

MASTERED_SHARE = 0.9
"""18 of 20."""
SETTLED_EPOCHS = 200
"""The last part of an era, on which trials over the optimum are taken."""
STATES_LIMIT = 4096


# ---------------------------------------------------------------------------------------------------- rules as a graph


def reachable_states(allowed: Allowed, n_goals: int, *, limit: int = STATES_LIMIT) -> list[GoalState]:
    """Return the goal-states that can be reached from none achieved, nearest first, at most `limit`."""
    start: GoalState = (False,) * n_goals
    states: list[GoalState] = [start]
    seen: set[GoalState] = {start}
    for state in states:
        for goal in range(n_goals):
            if state[goal] or not allowed(goal, state) or len(states) >= limit:
                continue
            following: GoalState = (*state[:goal], True, *state[goal + 1 :])
            if following not in seen:
                seen.add(following)
                states.append(following)
    return states


def optimal_trials(allowed: Allowed, n_goals: int) -> tuple[int | None, ...]:
    """Return for each goal the least number of trials that achieves it from none achieved; None where nothing can."""
    best: list[int | None] = [None] * n_goals
    for state in reachable_states(allowed, n_goals):
        for goal in range(n_goals):
            n_trials = sum(state) + 1
            known = best[goal]
            if not state[goal] and allowed(goal, state) and (known is None or n_trials < known):
                best[goal] = n_trials
    return tuple(best)


def graph_errors(predicted: Allowed, allowed: Allowed, states: Sequence[GoalState], n_goals: int) -> list[int]:
    """Return for each goal in how many of the states the prediction differs from the rules."""
    return [sum(predicted(goal, state) != allowed(goal, state) for state in states) for goal in range(n_goals)]


# ------------------------------------------------------------------------------------------------------- evaluations


class Era(msgspec.Struct, frozen=True, kw_only=True):
    """A span of epochs under the same rules: from_epoch <= epoch < until_epoch."""

    from_epoch: int
    until_epoch: int

    def holds(self, epoch: int) -> bool:
        """Whether an epoch lies in it."""
        return self.from_epoch <= epoch < self.until_epoch


def eras(changes: Sequence[int], n_epochs: int) -> list[Era]:
    """Return the eras of a run of n_epochs in which the rules change at the given epochs."""
    edges = [0, *(change for change in sorted(changes) if 0 < change < n_epochs), n_epochs]
    return [Era(from_epoch=start, until_epoch=end) for start, end in itertools.pairwise(edges)]


def due_evaluations(
    n_done: int,
    *,
    every: int,
    dense_every: int,
    dense_for: int,
    changes: Sequence[int],
    n_epochs: int,
    arrivals: Sequence[int] = (),
) -> list[int]:
    """Return under which epochs' rules to evaluate after n_done epochs; empty where nothing is due.

    At a change of rules both the old and the new are looked at, so that the drop is seen before anything is relearnt.
    Where goals become known (arrivals) it is as dense as after a change.
    """
    if n_done == 0:
        return []
    if n_done in changes and n_done < n_epochs:
        return [n_done - 1, n_done]
    since = [n_done - start for start in (0, *changes, *arrivals) if 0 < n_done - start <= dense_for]
    is_dense = any(elapsed % dense_every == 0 for elapsed in since)
    is_due = n_done % every == 0 or is_dense or n_done == n_epochs
    return [n_done - 1] if is_due else []


def due_graph_looks(n_done: int, *, every: int, changes: Sequence[int], n_epochs: int) -> list[int]:
    """Return under which epochs' rules to look at the learnt graph after n_done epochs; at a change under both."""
    if n_done in changes and 0 < n_done < n_epochs:
        return [n_done - 1, n_done]
    return [n_done - 1] if n_done > 0 and (n_done % every == 0 or n_done == n_epochs) else []


def is_mastered(row: EvaluationRow) -> bool:
    """Whether at least 18 of 20 test epochs succeeded; one cut short counts as failed."""
    return row.n_all > 0 and row.n_successes >= MASTERED_SHARE * row.n_all


def first_running(marks: Sequence[tuple[int, bool]], *, running: int) -> int | None:
    """Return the epoch of the first of so many true marks running, None if there is none."""
    count = 0
    for i, (_, is_true) in enumerate(marks):
        count = count + 1 if is_true else 0
        if count == running:
            return marks[i - running + 1][0]
    return None


# ----------------------------------------------------------------------------------------------------------- summary


class EraSummary(msgspec.Struct, frozen=True, kw_only=True):
    """What was reached under one set of rules. Epochs are counted from the era's start."""

    from_epoch: int
    until_epoch: int
    learnt_after: int | None
    """First of two evaluations running at which every goal is mastered: learnt, or recovered."""
    graph_right_after: int | None
    """First look, every ten epochs, at which the learnt graph is right for every goal in every reachable state."""
    graph_wrong_later: float | None
    """Share of the looks after that one at which it was wrong again; None without such looks."""
    graph_wrong_last: tuple[int, int] | None
    """Predictions that were wrong at the era's last look, and how many were compared; None where none was taken."""
    success_by_goal: tuple[float | None, ...]
    """Share of successes over the era's last 200 epochs' evaluations."""
    trials_by_goal: tuple[float | None, ...]
    """Mean trials of the successes, over the same evaluations."""
    optimal_by_goal: tuple[int | None, ...]
    trials_over_optimum: float | None
    """Mean over goals of the trials beyond the optimum; an epoch failed or cut short counts as all its trials."""
    trials_over_optimum_worst: float | None
    """The same of the goal that has the most."""
    trials_over_optimum_of_successes: float | None
    """The same of those that succeeded alone."""


class AddedGoal(msgspec.Struct, frozen=True, kw_only=True):
    """What became of a goal that was not known from the first epoch."""

    goal: int
    from_epoch: int
    mastered_after: int | None
    """First of two evaluations running at which it was mastered, counted from when it became known."""
    others_least_success: float | None
    """Least success of a goal known before, at any evaluation since, up to the next change of rules or new goal."""


class Summary(msgspec.Struct, frozen=True, kw_only=True):
    """A run in a few figures."""

    n_epochs: int
    """Epochs learnt so far."""
    n_trials: int
    n_time_steps: int
    """Decisions while learning."""
    n_void_epochs: int
    time_steps_to_all: int | None
    """Decisions while learning until every goal was learnt under the first rules."""
    choices_by_goal: tuple[int, ...]
    eras: tuple[EraSummary, ...]
    added: tuple[AddedGoal, ...] = ()
    """Goals that became known meanwhile."""


def summarise(
    goal_rows: Sequence[GoalRow],
    evaluation_rows: Sequence[EvaluationRow],
    graph_rows: Sequence[GraphRow],
    *,
    n_goals: int,
    n_trials: int,
    changes: Sequence[int],
    optima: Sequence[Sequence[int | None]],
    from_epochs: Sequence[int] = (),
) -> Summary:
    """Return the figures of a run from its rows.

    Args:
        goal_rows: One an epoch.
        evaluation_rows: One a goal and evaluation.
        graph_rows: One a look at the learnt graph.
        n_goals: How many goals there are.
        n_trials: Trials that an epoch has.
        changes: Epochs at which the rules changed.
        optima: Least trials of each goal, one sequence a set of rules; a run may not have come to all.
        from_epochs: Epoch from which each goal is known; empty: all from the first.
    """
    n_epochs = len(goal_rows)
    spans = eras(changes, n_epochs) if n_epochs else []
    parts = tuple(
        _summarise_era(
            era,
            [row for row in evaluation_rows if era.holds(row.rules_epoch)],
            [row for row in graph_rows if era.holds(row.rules_epoch)],
            best,
            n_trials,
        )
        for era, best in zip(spans, optima, strict=False)
    )
    learnt_at = parts[0].learnt_after if parts else None
    return Summary(
        n_epochs=n_epochs,
        n_trials=sum(row.n_trials for row in goal_rows),
        n_time_steps=sum(row.n_steps for row in goal_rows),
        n_void_epochs=sum(row.is_void for row in goal_rows),
        time_steps_to_all=None if learnt_at is None else sum(row.n_steps for row in goal_rows[:learnt_at]),
        choices_by_goal=tuple(sum(row.goal == goal for row in goal_rows) for goal in range(n_goals)),
        eras=parts,
        added=tuple(
            _added(goal, from_epochs, evaluation_rows, changes)
            for goal, start in enumerate(from_epochs)
            if 0 < start < n_epochs
        ),
    )


def _added(goal: int, from_epochs: Sequence[int], rows: Sequence[EvaluationRow], changes: Sequence[int]) -> AddedGoal:
    start = from_epochs[goal]
    until = min((epoch for epoch in (*from_epochs, *changes) if epoch > start), default=None)
    since = [row for row in rows if row.epoch > start]
    marks = [(row.epoch - start, is_mastered(row)) for row in since if row.goal == goal]
    others = [
        row.success for row in since if from_epochs[row.goal] < start and (until is None or row.rules_epoch < until)
    ]
    return AddedGoal(
        goal=goal,
        from_epoch=start,
        mastered_after=first_running(marks, running=2),
        others_least_success=min(others, default=None),
    )


def _summarise_era(
    era: Era,
    rows: Sequence[EvaluationRow],
    graph_rows: Sequence[GraphRow],
    optima: Sequence[int | None],
    n_trials: int,
) -> EraSummary:
    by_epoch: dict[int, list[EvaluationRow]] = {}
    for row in rows:
        by_epoch.setdefault(row.epoch, []).append(row)
    mastered = [(epoch, all(map(is_mastered, of_epoch))) for epoch, of_epoch in sorted(by_epoch.items())]
    right = [(row.epoch, row.n_wrong == 0) for row in graph_rows]
    right_at = first_running(right, running=1)
    later = [not is_right for epoch, is_right in right if right_at is not None and epoch > right_at]
    settled_from = max(era.from_epoch, era.until_epoch - SETTLED_EPOCHS)
    settled = [[row for row in rows if row.goal == goal and row.epoch > settled_from] for goal in range(len(optima))]
    trials = tuple(_ratio(_total(of_goal, "trials_achieved"), _total(of_goal, "n_successes")) for of_goal in settled)
    trials_all = [
        _ratio(_total(of_goal, "trials_all") + n_trials * _total(of_goal, "n_void"), _total(of_goal, "n_all"))
        for of_goal in settled
    ]
    return EraSummary(
        from_epoch=era.from_epoch,
        until_epoch=era.until_epoch,
        learnt_after=_since(era, first_running(mastered, running=2)),
        graph_right_after=_since(era, right_at),
        graph_wrong_later=fmean(later) if later else None,
        graph_wrong_last=(graph_rows[-1].n_wrong, graph_rows[-1].n_cases) if graph_rows else None,
        success_by_goal=tuple(_ratio(_total(of_goal, "n_successes"), _total(of_goal, "n_all")) for of_goal in settled),
        trials_by_goal=trials,
        optimal_by_goal=tuple(optima),
        trials_over_optimum=_mean(_excess(trials_all, optima)),
        trials_over_optimum_worst=max(_excess(trials_all, optima), default=None),
        trials_over_optimum_of_successes=_mean(_excess(trials, optima)),
    )


def _total(rows: Sequence[EvaluationRow], name: str) -> int:
    return sum(getattr(row, name) for row in rows)


def _ratio(part: int, whole: int) -> float | None:
    return part / whole if whole else None


def _since(era: Era, epoch: int | None) -> int | None:
    return None if epoch is None else epoch - era.from_epoch


def _excess(trials: Sequence[float | None], optima: Sequence[int | None]) -> list[float]:
    """Return trials beyond the optimum, of each goal that can be achieved; none at all if any never was."""
    excess = [None if n is None else n - best for n, best in zip(trials, optima, strict=True) if best is not None]
    known = [value for value in excess if value is not None]
    return known if len(known) == len(excess) else []


def _mean(values: Sequence[float]) -> float | None:
    return fmean(values) if values else None
