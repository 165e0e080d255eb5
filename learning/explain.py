"""What a learner believes each goal needs, told so that a person can check it. Goals are indices here as everywhere."""

import msgspec
import numpy as np

from learning.graph import Graph
from learning.preconditions import START, Kind, Situation, mask

__all__ = ["Explanation", "LiteralBelief", "explain_graph"]

WORTH_TELLING = 0.05


class LiteralBelief(msgspec.Struct, frozen=True, kw_only=True):
    """How probable it is that a goal needs another one on, or off."""

    goal: int
    is_on: bool
    probability: float


class Explanation(msgspec.Struct, frozen=True, kw_only=True):
    """What is believed of one goal, and why."""

    goal: int
    needs_on: tuple[int, ...]
    """Goals that must be achieved first, by the most probable conjunction."""
    needs_off: tuple[int, ...]
    """Goals that must not have been achieved in the epoch."""
    probability: float
    """Probability of that conjunction."""
    literals: tuple[LiteralBelief, ...]
    """Every literal worth telling, most probable first."""
    n_for: int
    """Remembered attempts since it last changed that came out as the conjunction says."""
    n_against: int
    n_for_before: int
    """The same of attempts before, which other rules may have decided."""
    n_against_before: int
    changed_epoch: int | None
    """When the most probable conjunction last changed. One that comes back after a doubt in which no other became more
    probable than not counts as unchanged."""
    skill: float
    plan: tuple[int, ...] | None
    """Goals to achieve one after the other from a fresh table; None where no way is known."""


def explain_graph(graph: Graph) -> tuple[Explanation, ...]:
    """Return what a graph believes of every goal."""
    return tuple(_explain(graph, goal) for goal in range(graph.n_goals))


def _explain(graph: Graph, goal: int) -> Explanation:
    needs, belief = graph.most_probable(goal), graph.beliefs[goal]
    changed_epoch = graph.changed_epoch(goal)
    agrees: dict[bool, list[bool]] = {True: [], False: []}
    for e in graph.evidence(goal):
        is_since = changed_epoch is None or e.epoch >= changed_epoch
        is_allowed = any(needs.allow(reading) for reading in e.readings)
        agrees[is_since].append((e.kind is Kind.ACHIEVED) == is_allowed)
    return Explanation(
        goal=goal,
        needs_on=_members(needs.on, graph.n_goals),
        needs_off=_members(needs.off, graph.n_goals),
        probability=belief.confidence,
        literals=_literals(graph, goal),
        n_for=agrees[True].count(True),
        n_against=agrees[True].count(False),
        n_for_before=agrees[False].count(True),
        n_against_before=agrees[False].count(False),
        changed_epoch=changed_epoch,
        skill=graph.skill(goal),
        plan=graph.plan(goal, START),
    )


def _literals(graph: Graph, goal: int) -> tuple[LiteralBelief, ...]:
    """Return marginals: a literal's probability is that of all conjunctions that hold it.

    The conjunctions that hold "i on" are those that refuse the goal where everything is on but i and nothing was
    latched that could be in the way; those that hold "i off" refuse it where everything is on and i alone was latched.
    """
    belief, n = graph.beliefs[goal], graph.n_goals
    everything = mask([True] * n)
    found = []
    for i in range(n):
        if i == goal:
            continue
        bit = 1 << i
        without = np.asarray(belief.allows(Situation(everything & ~bit, 0)))
        with_i_latched = np.asarray(belief.allows(Situation(everything, bit)))
        for is_on, allowed in ((True, without), (False, with_i_latched)):
            probability = float(belief.probabilities @ ~allowed)
            if probability >= WORTH_TELLING:
                found.append(LiteralBelief(goal=i, is_on=is_on, probability=probability))
    return tuple(sorted(found, key=lambda literal: -literal.probability))


def _members(bits: int, n: int) -> tuple[int, ...]:
    return tuple(i for i in range(n) if bits >> i & 1)
