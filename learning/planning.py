"""Planning over goal-states: which goals to achieve, in which order, so that a wanted one becomes possible. Pure.

A goal-state is a bit mask. What is achieved stays achieved in an epoch, so an action only adds a bit, and a goal that
something else needs off must wait. A failed attempt leaves the state as it was: under deterministic needs value
iteration comes down to the cheapest path, where a step costs the expected number of trials, 1 / chance of success.
"""

import heapq
from collections.abc import Callable, Sequence

from learning.preconditions import Needs

__all__ = ["cheapest_plan", "relevant_goals"]

MAX_EXPANSIONS = 5000
"""Goal-states looked at before a plan is given up (2^12 = 4,096)."""


def cheapest_plan(
    goal: int, state: int, needs_of: Callable[[int], Needs], costs: Sequence[float], carrying: Sequence[float]
) -> tuple[int, ...] | None:
    """Return the cheapest sequence of goals that ends with the wanted one, or None where there is none.

    Args:
        goal: the wanted goal, not yet in the state.
        state: goals achieved so far.
        needs_of: what each goal is taken to need.
        costs: expected trials to achieve each goal where nothing blocks it.  (n,)
        carrying: extra cost of each further step while a goal is on, for goals that get lost again.  (n,)
    """
    needs = {i: needs_of(i) for i in relevant_goals(goal, state, needs_of)}
    frontier: list[tuple[float, int, int]] = [(0.0, 0, state)]
    reached_by: dict[int, tuple[int, int]] = {}
    best = {state: 0.0}
    n_pushed = 0
    while frontier and len(reached_by) < MAX_EXPANSIONS:
        cost, _, here = heapq.heappop(frontier)
        if here >> goal & 1:
            return _trace(reached_by, here, state)
        if cost > best[here]:
            continue
        burden = sum(carrying[i] for i in needs if here >> i & 1)
        for i, needed in needs.items():
            there = here | 1 << i
            total = cost + costs[i] + burden
            if there != here and needed.allow(here) and total < best.get(there, float("inf")):
                best[there] = total
                reached_by[there] = (here, i)
                n_pushed += 1
                heapq.heappush(frontier, (total, n_pushed, there))
    return None


def relevant_goals(goal: int, state: int, needs_of: Callable[[int], Needs]) -> list[int]:
    """Return the wanted goal and all that must directly or indirectly be on for it and is not yet, in index order.

    Achieving anything else cannot help: it can only break a need for off.
    """
    found, open_goals = {goal}, [goal]
    while open_goals:
        missing = needs_of(open_goals.pop()).on & ~state
        while missing:
            lowest = missing & -missing
            missing ^= lowest
            i = lowest.bit_length() - 1
            if i not in found:
                found.add(i)
                open_goals.append(i)
    return sorted(found)


def _trace(reached_by: dict[int, tuple[int, int]], end: int, start: int) -> tuple[int, ...]:
    steps: list[int] = []
    while end != start:
        end, i = reached_by[end]
        steps.append(i)
    return tuple(reversed(steps))
