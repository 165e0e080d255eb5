"""Control experiments: what a revision calls for before it is believed.

A goal was found to come about in another way than was believed. The old way is tried once more, for a goal that no
longer needs what it needed may need its contrary: where a success without it came first, nothing speaks for that, and
nobody would provide again what seems of no use. And each new need is left out once, for what worked need not be what it
takes: where it was found in a long detour, the short way was perhaps never tried.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

from learning.graph import Finding, Graph
from learning.preconditions import START, Needs, Situation

__all__ = ["Controls", "Probe", "Spot", "probe_of", "violations"]

MOST_BEGUN = 3
"""A control that came to nothing so often, for the way to it failed, is given up."""

Spot = tuple[int, Situation]
"""A goal, and a situation in which it is tried."""


class Probe(NamedTuple):
    """Goals to achieve from the start of an epoch, the last of them the doubtful one."""

    steps: tuple[int, ...]
    situation: Situation
    """In which the doubtful goal is tried, as far as it is known what gets lost on the way."""

    @property
    def spot(self) -> Spot:
        """The doubtful goal, and the situation it is tried in."""
        return self.steps[-1], self.situation

    def next_step(self, latched: int) -> int | None:
        """Return what to try in a goal-state, or None where that is not on the way."""
        on_the_way = 0
        for step in self.steps:
            if on_the_way == latched:
                return step
            on_the_way |= 1 << step
        return None


def probe_of(goal: int, way: Needs, graph: Graph) -> Probe | None:
    """Return the probe of a goal in a situation that one way of needs asks for, or None where no plan leads there."""
    steps = graph.plan(goal, START, lambda i: way if i == goal else graph.most_probable(i))
    return Probe(steps, graph.follow(steps[:-1])) if steps else None


def violations(needs: Needs) -> tuple[Needs, ...]:
    """Return the same needs with one literal turned round, for each literal."""
    literals = [1 << j for j in range((needs.on | needs.off).bit_length()) if (needs.on | needs.off) >> j & 1]
    return tuple(Needs(needs.on ^ bit, needs.off ^ bit) for bit in literals)


class Controls:
    """The controls that are still to be done."""

    def __init__(self) -> None:
        self._begun: dict[tuple[int, Needs], int] = {}
        """How often each was begun: a goal, and the needs it is tried with."""

    def take_in(self, finding: Finding, graph: Graph) -> None:
        """Call for controls where needs were revised, and strike off what was tried."""
        goal, situation = finding.goal, finding.situation
        for tried in [key for key in self._begun if key[0] == goal]:
            probe = probe_of(*tried, graph)
            if finding.is_revised or probe is None or probe.situation == situation:
                del self._begun[tried]
        if finding.is_revised:
            needs = graph.most_probable(goal)
            self._begun.update({(goal, way): 0 for way in (finding.believed, *violations(needs))})

    def begin(self, graph: Graph, fits: Callable[[Probe], bool]) -> Probe | None:
        """Return the first control that fits into this epoch, or None.

        The old way is left out where the belief already says that it is closed: that is what revised it.
        """
        for tried, n_begun in list(self._begun.items()):
            goal, way = tried
            probe = probe_of(goal, way, graph)
            needs = graph.most_probable(goal)
            is_old_way = way not in violations(needs)
            if probe is None or n_begun >= MOST_BEGUN or (is_old_way and not needs.allow(probe.situation)):
                del self._begun[tried]
            elif fits(probe):
                self._begun[tried] = n_begun + 1
                return probe
        return None

    def state_dict(self) -> list[Any]:
        """Return what is still to be done."""
        return [[goal, list(way), n] for (goal, way), n in self._begun.items()]

    def load_state_dict(self, state: list[Any]) -> None:
        """Restore bit for bit."""
        self._begun = {(goal, Needs(*way)): n for goal, way, n in state}
