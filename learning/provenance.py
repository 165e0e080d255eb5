"""What a run is made of and with what it is made, as its folder keeps it."""

import hashlib
import subprocess
from pathlib import Path

from config.resolved import Resolved, dump_resolved
from config.scenario import Goal, Scenario
from learning.experiment import Oracle
from learning.metrics import optimal_trials
from learning.run_folder import GoalInfo, Manifest
from robot.bench import bench_report
from robot.messages import PlantIdentity

__all__ = ["changes_of", "manifest_of"]

GIT_PATIENCE_S = 5.0


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
        goals=tuple(GoalInfo(name=g.name, kind=g.kind.value, colour=_colour(g, scenario)) for g in scenario.goals),
        optima=tuple(_optima(oracle, epoch, len(scenario.goals)) for epoch in (0, *changes)),
        config_sha256=hashlib.sha256(dump_resolved(resolved).encode()).hexdigest(),
        plant=f"{identity.kind.value}/{identity.model}/{identity.serial}",
        model_sha256=model_sha256,
        git=_git_revision(),
        versions=here.versions,
        machine=here.machine,
    )


def changes_of(scenario: Scenario) -> tuple[int, ...]:
    """Return the epochs at which the rules change."""
    return tuple(span.from_epoch for span in scenario.schedule if span.from_epoch > 0)


def _optima(oracle: Oracle, epoch: int, n_goals: int) -> tuple[int | None, ...]:
    return optimal_trials(lambda goal, state: oracle(goal, state, epoch), n_goals)


def _colour(goal: Goal, scenario: Scenario) -> tuple[float, float, float]:
    """Return the colour of what a goal is about."""
    things = (*scenario.buttons, *scenario.cylinders, *scenario.boxes)
    return next(thing.colour for thing in things if thing.name == goal.object)


def _git_revision() -> str | None:
    """Return the commit of the checkout that this package lies in, -dirty where files differ; None outside one."""
    root = Path(__file__).parents[1]
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=GIT_PATIENCE_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() or None
