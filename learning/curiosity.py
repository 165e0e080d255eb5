"""What to try in order to know more: probes of doubtful, suspect and long untried preconditions.

Thompson sampling looks only at what serves the goal in hand. It never learns which of two pressed buttons it was that
blocked a goal (it presses neither), nor that something is needed no longer (it provides it). A probe goes where that
shows, if the epoch's goal can still be achieved after it.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from config.learning import SubgoalSelection
from learning.choice import draw
from learning.controls import Controls, Probe, Spot, probe_of, violations
from learning.graph import Finding, Graph
from learning.preconditions import START, Needs, Situation

__all__ = ["Curiosity", "most_hopeful_step", "random_walks"]

N_WALKS = 6
FADE = 0.998
"""How much of the memory of past probes is left after an epoch."""
WAKING = 0.5
"""Share of curiosity that one surprise brings back."""
N_SUSPICIONS = 3
"""Suspicions drawn when a probe is looked for."""
SURPRISE = 0.1
"""A result that had been given less than this chance is suspect."""
LITTLE = 0.3
"""Tries that make no difference."""
TIRING = 0.97
"""How much of it is left after a probe."""


NOTHING: Mapping[Spot, float] = {}


def random_walks(
    start: Situation, graph: Graph, *, n_walks: int, length: int, rng: np.random.Generator
) -> Iterator[tuple[tuple[int, ...], Situation]]:
    """Yield goals achieved and situation reached, at each of less than length steps, over what is believed allowed."""
    believed = [(i, graph.most_probable(i)) for i in range(graph.n_goals)]
    for _ in range(n_walks):
        steps, here = (), start
        while len(steps) < length:
            yield steps, here
            holds, latched = here
            ways = [i for i, (on, off) in believed if not (latched >> i & 1 or on & ~holds or off & latched)]
            if not ways:
                break
            step = ways[int(rng.integers(len(ways)))]
            steps, here = (*steps, step), here.after(step, graph.undone(step))


def most_hopeful_step(
    goal: int, start: Situation, graph: Graph, *, n_walks: int, length: int, rng: np.random.Generator,
    failures: Mapping[Spot, float] = NOTHING,
) -> int:  # fmt: skip
    """Return the first step towards where a goal has the best chance per trial, the goal itself if that is here.

    For a goal of which it is not known what it needs: what is cheap to try comes first, and each failure moves on.

    Args:
        goal: the wanted goal.
        start: the situation to start from.
        graph: what is believed.
        n_walks: random walks over what is believed allowed.
        length: most steps of each.
        rng: draws the walks.
        failures: how often it failed of late, by situation; where it just failed it hardly fares better.
    """
    best, best_value = goal, 0.0
    for steps, here in random_walks(start, graph, n_walks=n_walks, length=length, rng=rng):
        first = _hope(steps[0], start, graph, failures) if steps else 1.0
        chance = graph.beliefs[goal].predict_success(here) * graph.freedom(goal, here)
        value = first * chance / (len(steps) + 1) / (1.0 + failures.get((goal, here), 0.0))
        if value > best_value and not (steps and goal in steps):
            best, best_value = steps[0] if steps else goal, value
    return best


def _hope(step: int, here: Situation, graph: Graph, failures: Mapping[Spot, float]) -> float:
    """Return how hopeful the first step of a way is: less where it just failed, or where what holds keeps it away."""
    return graph.freedom(step, here) / (1.0 + failures.get((step, here), 0.0))


class Curiosity:
    """Starts a probe at some epochs' beginning and sees it through."""

    def __init__(self, *, config: SubgoalSelection, rng: np.random.Generator) -> None:
        self._config = config
        self._rng = rng
        self._probe: Probe | None = None
        self._tries: dict[Spot, float] = {}
        """How often probed; what stays doubtful though probed gets boring."""
        self._suspects: set[Spot] = set()
        """Where the last result was a surprise."""
        self._controls = Controls()
        self._interest = 1.0
        """Share of the configured curiosity; fruitless probes tire it, surprises wake it."""

    def step(self, goal: int, here: Situation, graph: Graph) -> int | None:
        """Return what to try for curiosity's sake while an epoch's goal is pursued, or None."""
        if here == START:
            self._probe = self._begin(goal, graph)
        step = self._probe.next_step(here.latched) if self._probe else None
        if self._probe and (step is None or step == self._probe.steps[-1]):
            self._probe = None
        return step

    def wake(self) -> None:
        """Be as curious as at first."""
        self._interest = 1.0

    def take_in(self, finding: Finding, graph: Graph) -> None:
        """Remember surprises, and look anew at a goal whose needs were revised."""
        self._controls.take_in(finding, graph)
        at = (finding.goal, finding.situation)
        if finding.is_revised:
            self._tries = {key: n for key, n in self._tries.items() if key[0] != finding.goal}
        if finding.expected < SURPRISE:
            self._suspects.add(at)
            self._interest = min(1.0, self._interest + WAKING)
        else:
            self._suspects.discard(at)

    # ------------------------------------------------------------------------------------------------------ probes

    def _begin(self, goal: int, graph: Graph) -> Probe | None:
        """Return a probe for an epoch with a goal, or None."""
        self._tries = {key: FADE * n for key, n in self._tries.items()}
        chance = self._rng.random()
        if chance < self._config.retest:
            probe = self._retest(goal, graph)
        elif chance < self._config.retest + self._config.curiosity * self._interest:
            probe = self._controls.begin(graph, lambda probe: self._fits(probe, goal, graph)) or self._most_doubtful(
                goal, graph
            )
        else:
            probe = None
        if probe is None:
            return None
        self._interest *= TIRING
        self._tries[probe.spot] = self._tries.get(probe.spot, 0.0) + graph.skill(probe.steps[-1])
        return probe

    def _most_doubtful(self, goal: int, graph: Graph) -> Probe | None:
        """Return the probe of most doubt per trial, or None where there is little doubt.

        It is one that random walks come by, or the test of one suspicion, to which no walk and no plan might ever lead.
        """
        best, best_value = None, self._config.least_doubt
        for probe, doubt in (*self._met_on_walks(graph), *self._suspected(graph)):
            value = doubt / len(probe.steps)
            if value > best_value and self._fits(probe, goal, graph):
                best, best_value = probe, value
        return best

    def _met_on_walks(self, graph: Graph) -> Iterator[tuple[Probe, float]]:
        """Yield the most doubtful goal of each situation that random walks lead to, and how doubtful it is."""
        known: dict[Situation, np.ndarray] = {}
        for steps, here in random_walks(START, graph, n_walks=N_WALKS, length=self._config.probe_trials, rng=self._rng):
            if here not in known:
                known[here] = self._doubts(here, graph)
            doubtful = int(np.argmax(known[here]))
            yield Probe((*steps, doubtful), here), float(known[here][doubtful])

    def _suspected(self, graph: Graph) -> Iterator[tuple[Probe, float]]:
        """Yield the test of one suspicion, drawn by how probable it is, and its doubt.

        What must be off goes unnoticed as long as no plan has it on, and what must be on while every plan has it on. So
        the goal is tried with all that it is believed to need, and the contrary of one more literal.
        """
        suspicions = np.array([belief.marginals() for belief in graph.beliefs])  # (n, n, 2): goal, literal, on or off
        for goal in range(graph.n_goals):
            needs, was_achieved = graph.most_probable(goal), graph.beliefs[goal].was_achieved
            is_new = [i != goal and was_achieved and not (needs.on | needs.off) >> i & 1 for i in range(graph.n_goals)]
            suspicions[goal] *= np.array(is_new)[:, None]
        if not suspicions.any():
            return
        for _ in range(N_SUSPICIONS):
            drawn = draw(suspicions.ravel() / suspicions.sum(), self._rng)
            goal, i, is_off = (int(index) for index in np.unravel_index(drawn, suspicions.shape))
            needs = graph.most_probable(goal)
            contrary = Needs(needs.on | 1 << i, needs.off) if is_off else Needs(needs.on, needs.off | 1 << i)
            probe = probe_of(goal, contrary, graph)
            if probe is not None:
                yield probe, float(self._doubts(probe.situation, graph)[goal])

    def _retest(self, goal: int, graph: Graph) -> Probe | None:
        """Return the probe of a believed literal, of those least tried: a goal is tried with only that one violated.

        The epoch may be given to it: with some literals violated hardly any goal can be achieved after it.
        """
        violated = [(g, way) for g in range(graph.n_goals) for way in violations(graph.most_probable(g))]
        ways = [probe for tried in violated if (probe := probe_of(*tried, graph)) and self._is_way(probe, goal)]
        if not ways:
            return None
        tries = np.array([self._tries.get(probe.spot, 0.0) for probe in ways])
        least = np.flatnonzero(tries <= tries.min() + LITTLE)
        return ways[least[int(self._rng.integers(len(least)))]]

    def _doubts(self, here: Situation, graph: Graph) -> np.ndarray:
        """Return how doubtful each goal not yet achieved is, less the more often it was probed.  () -> (n,)"""
        p = graph.predict_allowed(here)
        doubts = np.minimum(p, 1.0 - p)
        for i in range(graph.n_goals):
            if here.latched >> i & 1:
                doubts[i] = -1.0
            elif (i, here) in self._suspects:
                doubts[i] = 0.5
            doubts[i] *= graph.freedom(i, here) / (1.0 + self._tries.get((i, here), 0.0))
        return doubts

    def _fits(self, probe: Probe, goal: int, graph: Graph) -> bool:
        """Whether the epoch's goal can be achieved after a probe, however that ends, within the trials.

        On the way to the doubtful goal it must not be: there the epoch would end. An epoch may be given to what its own
        goal needs, though it fail for that.
        """
        tried = probe.steps[-1]
        if not self._is_way(probe, goal):
            return False
        if tried == goal:
            return True
        for end in (probe.situation, probe.situation.after(tried, graph.undone(tried))):
            rest = () if end.latched >> goal & 1 else graph.plan(goal, end)
            if rest is None or len(probe.steps) + len(rest) > self._config.probe_trials:
                return False
        return True

    def _is_way(self, probe: Probe, goal: int) -> bool:
        """Whether a probe can be seen through: the epoch ends with its goal, or with its last trial."""
        return goal not in probe.steps[:-1] and len(probe.steps) <= self._config.probe_trials

    def state_dict(self) -> dict[str, Any]:
        """Return all memory; the generator belongs to the selector."""
        return {
            "interest": self._interest,
            "probe": None if self._probe is None else [list(self._probe.steps), list(self._probe.situation)],
            "tries": [[goal, list(situation), n] for (goal, situation), n in self._tries.items()],
            "controls": self._controls.state_dict(),
            "suspects": [[goal, list(situation)] for goal, situation in sorted(self._suspects)],
        }

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._interest = float(state["interest"])
        probe = state["probe"]
        self._probe = None if probe is None else Probe(tuple(probe[0]), Situation(*probe[1]))
        self._tries = {(goal, Situation(*situation)): n for goal, situation, n in state["tries"]}
        self._controls.load_state_dict(state["controls"])
        self._suspects = {(goal, Situation(*situation)) for goal, situation in state["suspects"]}
