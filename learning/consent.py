"""What a person is told, and must agree to, before an arm is connected to."""

import os
import sys

import typer

from config.resolved import Resolved
from learning.errors import LearningError, RunFolderError
from learning.provenance import changes_of
from learning.robot_hours import Workload, workload_of
from learning.run_folder import RunFolder
from robot.rigs import check_learnable

__all__ = ["Consent"]

MAX_WORKERS = 4


class Consent:
    """Settles, for one session of a run, whether and how it may go on.

    Args:
        folder: the run's.
        workers: evaluation processes asked for; None keeps the processors busy, this process counted.

    Attributes:
        n_workers: how many there will be.
    """

    def __init__(self, folder: RunFolder, *, workers: int | None) -> None:
        self._folder = folder
        self._workers = workers
        self.n_workers = 0

    def __call__(self, resolved: Resolved, n_done: int) -> None:
        """Tell for how long a person has to be there, if one has; check the rig, count the workers, ask that person.

        Raises:
            RobotConfigError: nothing can be learnt on this rig.
            RunFolderError: workers were asked for where there is one arm.
            LearningError: nobody agreed.
        """
        is_by_person = resolved.rig.reset == "person"
        if is_by_person:
            self._tell(resolved, n_done)  # first: what it would take is worth knowing before the rig is whole
        check_learnable(resolved.rig)
        self.n_workers = _count(self._workers, is_one_arm=resolved.rig.bus is not None)
        if is_by_person:
            _ask()

    def _tell(self, resolved: Resolved, n_done: int) -> None:
        steps_done = None
        if n_done:
            steps_done = sum(row.n_steps for row in self._folder.trials() if row.epoch < n_done)
        work = workload_of(resolved, n_done=n_done, changes=changes_of(resolved.scenario), steps_done=steps_done)
        for line in _told(resolved, work):
            typer.echo(line, err=True)


def _ask() -> None:
    typer.echo("Enter goes on, Ctrl-C leaves", err=True)
    if not sys.stdin.readline():
        raise LearningError("expected a person's key before the arm is taken, the input has ended: nothing moved")


def _told(resolved: Resolved, work: Workload) -> list[str]:
    expected = "" if work.expected_h is None else f", {work.expected_h:.1f} h at the pace so far"
    rig = resolved.rig
    return [
        f"rig {rig.name}, arm {rig.expected.serial or 'not filled in'} at {rig.address or 'an address not filled in'}",
        f"robot-hours: at most {work.at_most_h:.1f} h of motion{expected}; resets not counted",
        f"resets by a person: {work.n_resets}, of which {work.n_tests} for evaluations",
    ]


def _count(asked: int | None, *, is_one_arm: bool) -> int:
    """Return how many evaluation processes there are beside this one."""
    if is_one_arm:
        if asked:
            raise RunFolderError(f"--workers: expected 0, this rig has one arm and one process has it; got {asked}")
        return 0
    return max(0, min(MAX_WORKERS, len(os.sched_getaffinity(0)) - 1)) if asked is None else asked
