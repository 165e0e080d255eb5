"""What always came before what, where somebody showed it: taken to be needed. Pure.

Ways that succeed alone never show what is needed, only what was there. But who shows a goal does not do needless things
every time: what came before a goal in nearly all of enough ways is taken to be there on purpose. It is put to the graph
as trials that nobody made, with that one thing missing, which came to nothing; what is tried later counts against them
like any other evidence.
"""

from collections.abc import Sequence

from learning.demonstrations import Shown
from learning.interfaces import Attempt, TrialOutcome

__all__ = ["ENOUGH", "imagined", "preceding"]

ENOUGH = 5
"""Ways to a goal from which on anything is concluded."""
NEARLY_ALL = 0.95
N_IMAGINED = 2
"""Trials that nobody made, for each goal and each thing it is taken to need."""

Needs = tuple[frozenset[int], ...]


def preceding(shown: Sequence[Shown], n_goals: int) -> Needs:
    """Return for each goal which others had come about before it in nearly all ways to it."""
    found: list[frozenset[int]] = []
    for goal in range(n_goals):
        before = [s.attempt.state for s in shown if s.distances_m and s.attempt.subgoal == goal]
        least = NEARLY_ALL * len(before)
        always = {k for k in range(n_goals) if k != goal and before and sum(state[k] for state in before) >= least}
        found.append(frozenset(always if len(before) >= ENOUGH else ()))
    return tuple(found)


def imagined(needs: Needs, *, epoch: int, skill: float) -> list[Attempt]:
    """Return trials without one of the things that came before: those that are needed for others alone left out.

    Args:
        needs: what came before each goal.
        epoch: that evidence bears.
        skill: chance of success at the place that they would have had.
    """
    found: list[Attempt] = []
    n_goals = len(needs)
    for goal, before in enumerate(needs):
        own = {k for k in before if not any(k in needs[j] for j in before)}
        for missing in sorted(own):
            state = tuple(k in before and k != missing and missing not in needs[k] for k in range(n_goals))
            attempt = Attempt(
                epoch=epoch, goal=goal, subgoal=goal, state=state, state_after=state, outcome=TrialOutcome.BLOCKED,
                predicted=skill, skill=skill, n_steps=0,
            )  # fmt: skip
            found += [attempt] * N_IMAGINED
    return found
