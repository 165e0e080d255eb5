"""Faults brought about on purpose, one after another at drawn processes, to see that a run bears them. State.

Only where no hardware is attached: a real arm's processes are not killed to see what happens.
"""

import signal
from collections.abc import Sequence
from enum import StrEnum

import msgspec
import numpy as np

from config.rig import Rig
from robot.errors import RobotConfigError

__all__ = ["Fault", "RandomFaults", "What", "check_faults"]


class What(StrEnum):
    """What befalls a process."""

    KILL = "killed"
    END = "told to end"
    BLINK = "frozen for 1 s"
    FREEZE = "frozen for 8 s"


FROZEN_S = {What.BLINK: 1.0, What.FREEZE: 8.0}
SIGNALS = {What.KILL: signal.SIGKILL, What.END: signal.SIGTERM, What.BLINK: signal.SIGSTOP, What.FREEZE: signal.SIGSTOP}


class Fault(msgspec.Struct, frozen=True, kw_only=True):
    """A signal that is due."""

    node: str
    what: What
    number: signal.Signals
    is_begin: bool = True
    """False where a frozen process is let go on."""


class RandomFaults:
    """Draws a process and a fault for it, at even times; a process that is frozen goes on when its time is over.

    Args:
        nodes: which there are.
        every_s: how far apart.
        rng: draws them.

    Attributes:
        n: how many were brought about.
    """

    def __init__(self, nodes: Sequence[str], *, every_s: float, rng: np.random.Generator) -> None:
        self._nodes, self._every_s, self._rng = tuple(nodes), every_s, rng
        self._next_s: float | None = None
        self._frozen: dict[str, float] = {}
        self.n = 0

    def due(self, now_s: float) -> list[Fault]:
        """Return what is due now; the first fault comes one interval after the first call."""
        if self._next_s is None:
            self._next_s = now_s + self._every_s
        over = [node for node, end_s in self._frozen.items() if now_s >= end_s]
        faults = [
            Fault(node=node, what=What.FREEZE, number=signal.SIGCONT, is_begin=False)
            for node in over if self._frozen.pop(node) is not None
        ]  # fmt: skip
        if now_s >= self._next_s:
            self._next_s += self._every_s
            faults.append(self._draw(now_s))
        return faults

    def _draw(self, now_s: float) -> Fault:
        node = self._nodes[self._rng.integers(len(self._nodes))]
        what = list(What)[self._rng.integers(len(What))]
        if what in FROZEN_S:
            self._frozen[node] = now_s + FROZEN_S[what]
        self.n += 1
        return Fault(node=node, what=what, number=SIGNALS[what])


def check_faults(rig: Rig) -> None:
    """Check that faults may be brought about at a rig.

    Raises:
        RobotConfigError: its plant is not a virtual one.
    """
    if rig.expected.kind != "virtual":
        raise RobotConfigError(
            f"rig {rig.name}: expected a virtual plant for faults on purpose, came one that is {rig.expected.kind}: "
            "leave --fault-every out"
        )
