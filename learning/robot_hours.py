"""How long an arm will work for a run, and how often its table must be laid out. Pure."""

import msgspec

from config.resolved import Resolved
from learning.metrics import due_evaluations

__all__ = ["Workload", "workload_of"]

S_PER_H = 3600.0


class Workload(msgspec.Struct, frozen=True, kw_only=True):
    """What is still to be done of a run."""

    n_resets: int
    """One before every epoch and every test epoch."""
    n_tests: int
    """Test epochs among them."""
    at_most_h: float
    """Hours of motion if every trial takes all its steps; resets not counted."""
    expected_h: float | None
    """The same at the pace of the epochs that are done; None where none are."""


def workload_of(
    resolved: Resolved, *, n_done: int, changes: tuple[int, ...], steps_done: int | None = None
) -> Workload:
    """Return what is still to be done.

    Args:
        resolved: what the run is made of.
        n_done: epochs done.
        changes: epochs at which the rules change.
        steps_done: time steps that those epochs took together; None where nobody counted.
    """
    protocol = resolved.learning.experiment
    n_goals = len(resolved.scenario.goals)
    n_evaluations = sum(
        len(
            due_evaluations(
                epoch,
                every=protocol.evaluate_every,
                dense_every=protocol.dense_every,
                dense_for=protocol.dense_for,
                changes=changes,
                n_epochs=protocol.epochs,
            )
        )
        for epoch in range(n_done + 1, protocol.epochs + 1)
    )
    n_tests = n_evaluations * n_goals * protocol.test_epochs
    n_resets = max(0, protocol.epochs - n_done) + n_tests
    step_h = resolved.arm.motion.step_s / S_PER_H
    expected = n_resets * steps_done / n_done * step_h if steps_done is not None and n_done else None
    return Workload(
        n_resets=n_resets,
        n_tests=n_tests,
        at_most_h=n_resets * protocol.trials * protocol.steps * step_h,
        expected_h=expected,
    )
