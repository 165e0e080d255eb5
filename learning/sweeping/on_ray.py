"""Cells on a Ray cluster, or on a Ray of this machine's own. The edge: needs the extra `ray`.

An actor a cell holds the very process that this machine's executor would start, on whichever machine Ray puts it: so
its bytes are the same. The sweep's folder must be there under the same path on all of them.
"""

import os
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from learning.errors import LearningError
from learning.sweeping.executor import End, Job
from learning.sweeping.local import LocalExecutor

__all__ = ["RayExecutor"]

STOP_S = 5.0
"""So long actors may take to end their processes before they are killed with them."""
NO_TELLING = {"RAY_USAGE_STATS_ENABLED": "0"}
"""Ray would tell its makers of each start."""


class _Cell:
    """One cell's process, on the machine that Ray chose for it. Its methods run there."""

    def __init__(self, job: Job, logs: str) -> None:
        self._here = LocalExecutor(n_slots=1, logs=Path(logs))
        self._here.start(job)

    def look(self) -> End | None:
        """Return how it ended, None while it runs."""
        return next(iter(self._here.ended()), None)

    def ask_to_stop(self) -> None:
        """Ask it to come to an end that loses nothing."""
        self._here.ask_to_stop()

    def close(self) -> None:
        """End it at once."""
        self._here.close()


class RayExecutor:
    """Implements learning.sweeping.executor.Executor by actors of a Ray cluster, a processor each.

    A cell whose worker is lost has failed like one whose process was killed: whoever runs the sweep starts it again,
    and it goes on from its newest checkpoint.

    Args:
        address: of a cluster that runs; None starts a Ray on this machine that ends with this process.
        n_slots: how many at a time; None takes a cell a processor of the cluster.
        logs: folder for what each cell says.

    Raises:
        LearningError: Ray is not installed, or there is no cluster at the address.
    """

    def __init__(self, *, address: str | None, n_slots: int | None, logs: Path) -> None:
        os.environ.update(NO_TELLING)
        try:
            ray: Any = import_module("ray")  # an extra, and seconds
        except ImportError as error:
            raise LearningError("expected Ray for `--on ray`: pip install 'autotelic[ray]'") from error
        own = {"num_cpus": n_slots, "include_dashboard": False} if address is None else {}
        try:
            ray.init(address=address or "local", log_to_driver=False, configure_logging=False, **own)
        except (ConnectionError, ValueError, RuntimeError) as error:
            raise LearningError(f"expected a Ray cluster at {address or 'this machine'}, got none: {error}") from error
        self._ray = ray
        self._n_slots = n_slots or max(1, int(ray.cluster_resources().get("CPU", 1)))
        self._actor = ray.remote(num_cpus=1, max_restarts=0)(_Cell)
        self._logs = logs
        self._running: dict[str, tuple[Any, Any]] = {}
        """By name: the actor, and the answer to the newest look that is waited for."""

    @property
    def n_slots(self) -> int:
        """How many jobs run at a time."""
        return self._n_slots

    def start(self, job: Job) -> None:
        """Have Ray start an actor that starts the process."""
        actor = self._actor.remote(job, str(self._logs.absolute()))
        self._running[job.name] = (actor, actor.look.remote())

    def ended(self) -> Sequence[End]:
        """Return which cells ended since the last look; one whose worker was lost has failed."""
        answers = {answer: name for name, (_, answer) in self._running.items()}
        if not answers:
            return []
        ready, _ = self._ray.wait(list(answers), num_returns=len(answers), timeout=0)
        return [end for answer in ready if (end := self._take(answers[answer])) is not None]

    def _take(self, name: str) -> End | None:
        """Return how a cell ended whose answer is there; one that runs on is looked at again."""
        actor, answer = self._running[name]
        try:
            end = self._ray.get(answer)
        except self._ray.exceptions.RayError as error:
            del self._running[name]
            return End(name=name, why_failed=f"its worker was lost: {str(error).strip().splitlines()[0]}")
        if end is None:
            self._running[name] = (actor, actor.look.remote())
            return None
        del self._running[name]
        self._ray.kill(actor)
        return end

    def ask_to_stop(self) -> None:
        """Ask each cell to end its epoch and keep everything."""
        for actor, _ in self._running.values():
            actor.ask_to_stop.remote()

    def close(self) -> None:
        """Kill what still runs, and leave the cluster."""
        if not self._ray.is_initialized():
            return
        closing = [actor.close.remote() for actor, _ in self._running.values()]
        if closing:
            self._ray.wait(closing, num_returns=len(closing), timeout=STOP_S)
        for actor, _ in self._running.values():
            self._ray.kill(actor)
        self._running = {}
        self._ray.shutdown()
