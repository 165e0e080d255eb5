"""Planning over goal-states: which goals to achieve, in which order, so that a wanted one becomes possible. Pure.

What is achieved stays on, save what gets lost on the way (a hand that takes one thing lets
go of another), and a goal that something else needs off must wait. A failed attempt leaves the situation as it was:
under given needs value iteration comes down to the cheapest path, where a step costs the expected number of trials,
1 / chance of success.
"""

import heapq
from collections.abc import Callable, Iterable, Sequence

import msgspec

from learning.preconditions import Needs, Situation

__all__ = ["Effort", "cheapest_plan", "relevant_goals"]

MAX_EXPANSIONS = 5000
"""Situations reached before a plan is given up (2^12 = 4,096)."""
INFINITE = float("inf")


class Effort(msgspec.Struct, frozen=True, kw_only=True):
    """What the steps of a plan take, and what they undo."""

    trials: Sequence[float]
    """Expected trials to achieve each goal where nothing blocks it.  (n,)"""
    losses: Sequence[Sequence[float]]
    """[j][k]: chance that achieving goal j loses goal k; from one half on it is counted on, below a cost.  (n, n)"""


def cheapest_plan(
    goal: int, start: Situation, needs_of: Callable[[int], Needs], effort: Effort
) -> tuple[int, ...] | None:
    """Return the cheapest sequence of goals that ends with the wanted one, or None where there is none.

    Args:
        goal: the wanted goal, which does not hold at the start.
        start: the situation to start from.
        needs_of: what each goal is taken to need.
        effort: what the steps take.
    """
    needs = {i: needs_of(i) for i in relevant_goals(goal, needs_of)}
    undone = {j: sum(1 << k for k, loss in enumerate(effort.losses[j]) if loss >= 0.5) for j in needs}
    frontier: list[tuple[float, int, Situation]] = [(0.0, 0, start)]
    reached_by: dict[Situation, tuple[Situation, int]] = {}
    best = {start: 0.0}
    while frontier and len(best) < MAX_EXPANSIONS:
        cost, _, here = heapq.heappop(frontier)
        if here.holds >> goal & 1:
            return _trace(reached_by, here, start)
        if cost > best[here]:
            continue
        for i, needed in needs.items():
            if here.holds >> i & 1 or not needed.allow(here):
                continue
            there = here.after(i, undone[i])
            total = cost + effort.trials[i] + _risk(effort.losses[i], here.holds & ~undone[i], needs)
            if total < best.get(there, INFINITE):
                best[there] = total
                reached_by[there] = (here, i)
                heapq.heappush(frontier, (total, len(best), there))
    return None


def relevant_goals(goal: int, needs_of: Callable[[int], Needs]) -> list[int]:
    """Return the wanted goal and all that must directly or indirectly be on for it, in index order.

    Achieving anything else cannot help: it can only break a need for off.
    """
    found, open_goals = {goal}, [goal]
    while open_goals:
        needed = needs_of(open_goals.pop()).on
        while needed:
            lowest = needed & -needed
            needed ^= lowest
            i = lowest.bit_length() - 1
            if i not in found:
                found.add(i)
                open_goals.append(i)
    return sorted(found)


def _risk(losses: Sequence[float], carried: int, relevant: Iterable[int]) -> float:
    """Return the expected number of relevant goals lost by a step, of those that may get lost."""
    return sum(losses[k] for k in relevant if carried >> k & 1)


def _trace(reached_by: dict[Situation, tuple[Situation, int]], end: Situation, start: Situation) -> tuple[int, ...]:
    steps: list[int] = []
    while end != start:
        end, i = reached_by[end]
        steps.append(i)
    return tuple(reversed(steps))
