"""A run is taken up elsewhere: a folder of its own that goes on from another's newest checkpoint. The edge: files."""

from typing import Any

from config.resolved import Resolved, dump_resolved
from learning.assembly import RobotLearner
from learning.checkpoint import encode, write_atomically
from learning.errors import LearningError
from learning.provenance import manifest_of
from learning.run_folder import CONFIG_NAME, MANIFEST_NAME, RunFolder
from learning.tables import TABLES, Tables
from robot.oracle import rules_oracle

__all__ = ["fork", "learnt_state"]


def learnt_state(run: RunFolder) -> dict[str, Any]:
    """Return a run's newest checkpoint.

    Raises:
        RunFolderError: this is no run folder.
        CheckpointError: no checkpoint can be read.
        LearningError: the run has learnt nothing yet, or not in lock-step.
    """
    manifest, resolved = run.manifest(), run.config()
    if resolved.rig.expected.kind != "twin" or resolved.rig.bus is not None:
        raise LearningError(
            f"{run.path}: expected a run on a twin in lock-step, whose physics can be changed, it is on {manifest.rig}"
        )
    state, _ = run.checkpoints.newest()
    if state["n_done"] == 0:
        raise LearningError(f"{run.path}: expected a run that has learnt, it has done no epoch: go on with it first")
    return state


def fork(folder: RunFolder, resolved: Resolved, state: dict[str, Any], *, seed: int) -> None:
    """Make a folder a run's that has done as much as a checkpoint says, and kept no rows of it.

    Args:
        folder: entered; what a fork that was killed left in it is written anew.
        resolved: what the run goes on by.
        state: of the checkpoint that it goes on from.
        seed: root seed of all that is drawn from now on, but for what the checkpoint's generators draw.
    """
    learner = RobotLearner(resolved, seed=seed)
    try:
        manifest = manifest_of(
            resolved, seed=seed, oracle=rules_oracle(resolved), identity=learner.identity,
            model_sha256=learner.model_sha256,
        )  # fmt: skip
    finally:
        learner.close()
    Tables(folder.path).close()
    begun = {
        "n_done": state["n_done"],
        "n_void_running": 0,
        "n_rows": dict.fromkeys(TABLES, 0),
        "agent": state["agent"],
    }
    folder.checkpoints.save(state["n_done"], encode(begun))
    folder.write_json(MANIFEST_NAME, manifest)
    # The config comes last: with it the folder is a run's.
    write_atomically(folder.path / CONFIG_NAME, dump_resolved(resolved).encode())
