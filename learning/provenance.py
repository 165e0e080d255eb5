"""What a run is made of and with what it is made, as its folder keeps it."""

import hashlib

from config.resolved import Resolved, dump_resolved
from config.scenario import Goal, Scenario
from learning.experiment import Oracle
from learning.metrics import optimal_trials
from learning.run_folder import GoalInfo, Manifest
from robot.bench import bench_report
from robot.messages import PlantIdentity
from robot.revision import git_revision

__all__ = ["changes_of", "manifest_of"]


def manifest_of(
    resolved: Resolved, *, seed: int, oracle: Oracle, identity: PlantIdentity, model_sha256: str | None
) -> Manifest:
    """Return the manifest of a run that is about to start."""
    scenario, protocol = resolved.scenario, resolved.learning.experiment
    changes = changes_of(scenario)
    here = bench_report("run", (), seconds=0.0)
    return Manifest(
        seed=seed,
        learner=resolved.learning.name,
        scenario=scenario.name,
        rig=resolved.rig.name,
        n_epochs=protocol.epochs,
        n_trials=protocol.trials,
        changes=changes,
        goals=tuple(_info(g, scenario) for g in scenario.goals),
        optima=tuple(_optima(oracle, epoch, len(scenario.goals)) for epoch in (0, *changes)),
        config_sha256=hashlib.sha256(dump_resolved(resolved).encode()).hexdigest(),
        plant=f"{identity.kind.value}/{identity.model}/{identity.serial}",
        model_sha256=model_sha256,
        git=git_revision(),
        versions=here.versions,
        machine=here.machine,
    )


def changes_of(scenario: Scenario) -> tuple[int, ...]:
    """Return the epochs at which the rules change."""
    return tuple(span.from_epoch for span in scenario.schedule if span.from_epoch > 0)


def _optima(oracle: Oracle, epoch: int, n_goals: int) -> tuple[int | None, ...]:
    return optimal_trials(lambda goal, state: oracle(goal, state, epoch), n_goals)


def _info(goal: Goal, scenario: Scenario) -> GoalInfo:
    colour = _colour(goal, scenario)
    return GoalInfo(name=goal.name, kind=goal.kind.value, colour=colour, from_epoch=goal.from_epoch)


def _colour(goal: Goal, scenario: Scenario) -> tuple[float, float, float]:
    """Return the colour of what a goal is about."""
    things = (*scenario.buttons, *scenario.cylinders, *scenario.boxes)
    return next(thing.colour for thing in things if thing.name == goal.object)
