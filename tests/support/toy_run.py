"""A whole run on the toy, with ways to stop and to kill it."""

import os
import signal
import sys
from pathlib import Path

from config.learning import Experiment as Protocol
from learning.checkpoint import CheckpointStore
from learning.evaluation_pool import EvaluationPool
from learning.experiment import Experiment, Plan
from learning.tables import Tables
from tests.support.toy_learner import CHANGE_EPOCH, make_toy_learner, toy_allowed, toy_maker

__all__ = ["FILES", "PROTOCOL", "ToyRun", "files_of"]

PROTOCOL = Protocol(
    epochs=120, evaluate_every=20, test_epochs=10, dense_every=10, dense_for=20, checkpoint_every=10, steps=30
)

FILES = ("trials.csv", "goals.csv", "graphs.csv", "evaluations.csv", "newest checkpoint")


class ToyRun:
    """A run folder, a toy learner, and the experiment between them."""

    def __init__(
        self, folder: Path, protocol: Protocol, *, seed=0, n_workers=0, resume=False, void_epochs=(), station=None
    ):
        self.folder = folder
        self.said: list[str] = []
        self.kill_workers_at: int | None = None
        self._n_epochs = 0
        self._seed, self._protocol = seed, protocol
        self._n_workers, self._void_epochs = n_workers, void_epochs
        self._resume, self._station = resume, station

    # The watcher's door.

    def epoch_begins(self, epoch, goal):
        pass

    def epoch_ended(self, record):
        self._n_epochs = record.epoch + 1
        if self._n_epochs == self.kill_workers_at:
            for worker in self._pool._workers:
                os.kill(worker.process.pid, signal.SIGKILL)

    def evaluated(self, rows):
        pass

    def go(self, *, stop_at: int | None = None) -> int:
        """Run until the end, or stop after so many epochs."""
        store = CheckpointStore(self.folder / "checkpoints")
        state = store.newest()[0] if self._resume else None
        learner = make_toy_learner(self._seed, self._protocol, self._void_epochs)
        station = self._station or learner.station
        tester = make_toy_learner(self._seed, self._protocol, self._void_epochs)
        maker = toy_maker(self._seed, self._protocol, self._void_epochs)
        self._pool = EvaluationPool(
            tester=tester.agent,
            station=station,
            make_learner=maker,
            n_workers=self._n_workers,
            report=self.said.append,
        )
        with self._pool, Tables(self.folder, n_rows=state and state["n_rows"]) as tables:
            experiment = Experiment(
                plan=Plan(seed=self._seed, protocol=self._protocol, changes=(CHANGE_EPOCH,)),
                agent=learner.agent,
                station=station,
                pool=self._pool,
                tables=tables,
                store=store,
                watcher=self,
                oracle=toy_allowed,
            )
            if state is not None:
                experiment.restore(state)
            self._pool.wait_until_ready()
            return experiment.run(lambda: self._n_epochs == stop_at)


def files_of(folder: Path) -> dict[str, bytes]:
    """Return what must be the same in two runs."""
    newest = max((folder / "checkpoints").iterdir(), key=lambda path: path.name)
    return {name: (folder / name).read_bytes() for name in FILES[:-1]} | {"newest checkpoint": newest.read_bytes()}


def _kill_at(n_events: int) -> None:
    """Kill this process at its so-manyth call or return of any function, in the middle of whatever it does."""
    seen = 0

    def hook(frame: object, event: str, argument: object) -> None:
        nonlocal seen
        seen += 1
        if seen == n_events:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.setprofile(hook)


if __name__ == "__main__":
    FOLDER, N_EVENTS = Path(sys.argv[1]), int(sys.argv[2])
    if N_EVENTS:
        _kill_at(N_EVENTS)
    RUN = ToyRun(FOLDER, PROTOCOL, seed=5, resume=CheckpointStore(FOLDER / "checkpoints").exists())
    RUN.go()
