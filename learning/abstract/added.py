"""A goal that becomes known while others are learnt, without physics: how soon it is mastered, at what cost to them."""

import msgspec
import numpy as np

from learning.abstract.learner import AbstractLearner, MakeAbstract
from learning.abstract.protocol import DENSE_EVERY, N_ENOUGH, N_TESTS
from learning.abstract.rules import Rules
from learning.abstract.table import AbstractTable, Skills
from learning.metrics import first_running

__all__ = ["Added", "run_added"]


class Added(msgspec.Struct, frozen=True, kw_only=True):
    """What came of goals that were added, epochs counted since."""

    mastered_after: int | None
    """First of two evaluations running, every ten epochs, at which each was achieved in 18 of 20 test epochs."""
    old_least_success: float
    """Least share of test epochs in which one of the others was achieved, at any evaluation since."""


def run_added(
    *, seed: int, learner: MakeAbstract, rules: Rules, n_known: int, at: int, epochs: int, skills: Skills | None = None
) -> Added:
    """Learn the first goals for a while, take in the others, and go on.

    Args:
        seed: of table and learner.
        learner: makes it, for the goals that it knows at first.
        rules: of all goals.
        n_known: how many are known at first.
        at: epochs before the others are added.
        epochs: after that.
        skills: how experts fare.
    """
    first, second = np.random.default_rng(seed).spawn(2)
    table = AbstractTable(n_goals=len(rules), skills=skills or Skills(), rng=first)
    table.rules = rules
    made = learner(n_known, second)
    for epoch in range(at):
        made.learn_epoch(table, epoch)
    made.grow(len(rules))
    marks, old = [], [1.0]
    for i in range(1, epochs + 1):
        made.learn_epoch(table, at + i)
        if i % DENSE_EVERY == 0:
            counts = [_n_achieved(made, table, at + i, goal) for goal in range(len(rules))]
            marks.append((i, min(counts[n_known:]) >= N_ENOUGH))
            old.append(min(counts[:n_known]) / N_TESTS)
    return Added(mastered_after=first_running(marks, running=2), old_least_success=min(old))


def _n_achieved(learner: AbstractLearner, table: AbstractTable, epoch: int, goal: int) -> int:
    return sum(learner.test_epoch(table, epoch, goal)[0] for _ in range(N_TESTS))
