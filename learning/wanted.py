"""What a person asked for on the command line, and whether a run is that."""

import msgspec

from config.learning import LearningConfig
from config.loader import load_learning, load_rig, load_wired, resolve, with_rig
from config.resolved import Resolved
from learning.errors import RunFolderError

__all__ = ["Wanted", "refuse_another", "resolve_wanted"]

JUDGED = {"dense_every": 10, "dense_for": 150, "test_epochs": 20}
"""How judged runs evaluate."""


class Wanted(msgspec.Struct, frozen=True, kw_only=True):
    """What was asked for; None where nothing was."""

    scenario: str | None = None
    rig: str | None = None
    preset: str | None = None
    seed: int | None = None
    epochs: int | None = None
    judged: bool = False


def resolve_wanted(wanted: Wanted) -> Resolved:
    """Return the config of a new run.

    Raises:
        ConfigError: a file is missing or wrong.
    """
    resolved = resolve(
        rig=wanted.rig or "twin", scenario=wanted.scenario or "paper", learning=wanted.preset or "default"
    )
    return msgspec.structs.replace(resolved, learning=_with_protocol(resolved.learning, wanted))


def refuse_another(wanted: Wanted, folder: str, resolved: Resolved, seed: int) -> None:
    """Check that what was asked for is what a folder holds.

    Raises:
        RunFolderError: it differs.
        ConfigError: a file is missing or wrong, or the rig's arm is no longer what it was.
    """
    stored = resolved.learning
    same = {
        "--seed": wanted.seed is None or wanted.seed == seed,
        "--scenario": wanted.scenario is None or load_wired(wanted.scenario) == (resolved.scenario, resolved.rule_sets),
        "--rig": wanted.rig is None or _is_same_rig(wanted.rig, resolved),
        "--preset": wanted.preset is None or _with_experiment(load_learning(wanted.preset), stored) == stored,
        "--epochs": wanted.epochs is None or wanted.epochs == stored.experiment.epochs,
        "--judged": not wanted.judged or _with_protocol(stored, wanted) == stored,
    }
    differing = [name for name, is_same in same.items() if not is_same]
    if differing:
        raise RunFolderError(
            f"{folder} holds a run with another {' and '.join(differing)}: leave that out to go on with it, "
            "or name another folder by --out"
        )


def _is_same_rig(rig: str, resolved: Resolved) -> bool:
    """Whether a rig is the one of before, its cell's file too. Another arm's file is a ConfigError."""
    return load_rig(rig) == resolved.rig and with_rig(resolved, rig) == resolved


def _with_protocol(learning: LearningConfig, wanted: Wanted) -> LearningConfig:
    """Return the learner with the number of epochs asked for and, for judged runs, dense evaluation."""
    epochs = {} if wanted.epochs is None else {"epochs": wanted.epochs}
    changes = epochs | (JUDGED if wanted.judged else {})
    return msgspec.structs.replace(learning, experiment=msgspec.structs.replace(learning.experiment, **changes))


def _with_experiment(learning: LearningConfig, other: LearningConfig) -> LearningConfig:
    return msgspec.structs.replace(learning, experiment=other.experiment)
