"""Complete run folders made by the toy, for whatever reads run folders."""

import shutil
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from config.loader import resolve
from config.resolved import dump_resolved
from learning.metrics import optimal_trials
from learning.run_folder import GoalInfo, Manifest, RunFolder
from learning.tables import Tables
from tests.support.toy_learner import CHANGE_EPOCH, N_GOALS, toy_allowed
from tests.support.toy_run import PROTOCOL, ToyRun

__all__ = ["COLOURS", "make_started_toy_folder", "make_toy_folder", "toy_manifest"]

COLOURS = ((0.95, 0.5, 0.08), (0.12, 0.35, 0.85), (0.10, 0.20, 0.75), (0.10, 0.20, 0.75))
KINDS = ("pressed", "pressed", "grabbed", "in_box")


def toy_manifest(*, seed=0, learner="toy", scenario="lamps", changes=(CHANGE_EPOCH,)) -> Manifest:
    """Return a manifest as if the toy were a robot."""
    optima = tuple(optimal_trials(lambda g, s, e=epoch: toy_allowed(g, s, e), N_GOALS) for epoch in (0, *changes))
    return Manifest(
        seed=seed,
        learner=learner,
        scenario=scenario,
        rig="toy",
        n_epochs=PROTOCOL.epochs,
        n_trials=PROTOCOL.trials,
        changes=changes,
        goals=tuple(GoalInfo(name=f"lamp_{i}", kind=KINDS[i], colour=COLOURS[i]) for i in range(N_GOALS)),
        optima=optima,
        config_sha256="",
        plant="fake/toy/0",
        model_sha256=None,
        git=None,
        versions={"numpy": "2"},
        machine={"cores": 2},
    )


def make_toy_folder(path: Path, *, seed=0, learner="toy") -> RunFolder:
    """Return a folder with a whole run of the toy in it, one's own to spoil."""
    shutil.copytree(Path(_ran(seed, learner).name) / "run", path, dirs_exist_ok=True)
    return RunFolder(path)


@cache
def _ran(seed: int, learner: str) -> TemporaryDirectory[str]:
    """Run the toy, once for all who ask for a copy: the same seed makes the same run."""
    kept = TemporaryDirectory(prefix="autotelic-toy-")
    path = Path(kept.name) / "run"
    folder = RunFolder(path)
    with folder:
        folder.start(toy_manifest(seed=seed, learner=learner), dump_resolved(resolve()))
        ToyRun(path, PROTOCOL, seed=seed).go()
    return kept


def make_started_toy_folder(path: Path) -> RunFolder:
    """Return a folder in which a run was begun and has not done an epoch."""
    folder = RunFolder(path)
    with folder:
        folder.start(toy_manifest(), dump_resolved(resolve()))
        Tables(path).close()
    return folder
