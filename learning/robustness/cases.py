"""What is tried on a run: a table of cases. Each changes the physics, what is perceived, or how well experts do."""

import msgspec

from config.perturbation import Perturbation
from config.resolved import Resolved
from learning.errors import LearningError

__all__ = ["CASES", "LOOK_EVERY", "Case", "case_named", "under_case"]

LOOK_EVERY = 10
"""Epochs between looks at the graph, and between checkpoints, so that little is done twice."""


class Case(msgspec.Struct, frozen=True, kw_only=True):
    """One thing that is not as it was when the run learnt."""

    name: str
    says: str
    """What it is, for a person."""
    perturbation: Perturbation | None = None
    carried_out: float = 1.0
    """Times the share of trials in which the arm does what experts ask."""


def _changed(name: str, says: str, **by: float | bool | tuple[float, float, float]) -> Case:
    return Case(name=name, says=says, perturbation=Perturbation(name=name, **by))  # pyright: ignore[reportArgumentType]


CASES = (
    Case(name="nominal", says="as learnt"),
    _changed("lag_plus_20", "lag +20 %", lag_factor=1.2),
    _changed("lag_minus_20", "lag -20 %", lag_factor=0.8),
    _changed("mass_plus_20", "masses +20 %", mass_factor=1.2),
    _changed("mass_minus_20", "masses -20 %", mass_factor=0.8),
    _changed("friction_plus_20", "friction +20 %", friction_factor=1.2),
    _changed("friction_minus_20", "friction -20 %", friction_factor=0.8),
    _changed("kinematics_plus_2mm", "links, tool +2 mm", kinematics_m=0.002, tells_belief=True),
    _changed("percept_1cm_away", "seen 1 cm away", percept_m=(0.01, 0.0, 0.0)),
    _changed("percept_1cm_aside", "seen 1 cm aside", percept_m=(0.0, 0.01, 0.0)),
    Case(name="experts_60", says="experts at 60 %", carried_out=0.6),
)
"""The first is the one that others are compared with."""


def case_named(name: str) -> Case:
    """Return a case by its name.

    Raises:
        LearningError: there is none of that name.
    """
    found = [case for case in CASES if case.name == name]
    if not found:
        raise LearningError(f"expected a case of {', '.join(case.name for case in CASES)}, got {name}")
    return found[0]


def under_case(resolved: Resolved, case: Case, *, n_done: int, n_more: int, n_tests: int) -> Resolved:
    """Return what a run goes on by under a case: the same learner, on another twin, under the rules now in force.

    Args:
        resolved: of the run.
        case: what differs.
        n_done: epochs that the run has done.
        n_more: epochs to go on for.
        n_tests: test epochs a goal, at the end.
    """
    scenario, learning = resolved.scenario, resolved.learning
    schedule = tuple(span for span in scenario.schedule if span.from_epoch < n_done)
    protocol = msgspec.structs.replace(
        learning.experiment,
        epochs=n_done + n_more, evaluate_every=n_done + n_more, dense_for=0, dense_every=LOOK_EVERY,
        checkpoint_every=LOOK_EVERY, test_epochs=n_tests,
    )  # fmt: skip
    expert = msgspec.structs.replace(learning.expert, carried_out=learning.expert.carried_out * case.carried_out)
    return msgspec.structs.replace(
        resolved,
        rig=msgspec.structs.replace(resolved.rig, perturbation=case.perturbation or resolved.rig.perturbation),
        scenario=msgspec.structs.replace(scenario, schedule=schedule),
        rule_sets=resolved.rule_sets[: len(schedule)],
        learning=msgspec.structs.replace(learning, experiment=protocol, expert=expert),
    )
