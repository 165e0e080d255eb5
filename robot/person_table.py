"""Where things on a table stand that a person lays out: as they are perceived, by whatever perceives there. State."""

from collections.abc import Callable
from time import monotonic_ns
from typing import Protocol

from robot.errors import StaleStateError
from robot.hal.protocols import SceneTruth
from robot.messages import ArmState, ObjectPose, Percept, SceneState
from robot.station_doors import Perceives, Sighted

__all__ = ["PerceivedTable"]

LOOK_NS = 3_000_000_000
"""How long it is looked for what is not seen at once: the arm is parked, and hands are still drawn back."""


class _Measures(Protocol):
    """What is needed of whatever holds the arm."""

    def measure(self) -> ArmState:
        """Read the arm, in command of it or not."""
        ...


class PerceivedTable:
    """Implements robot.hal.protocols.SceneTruth by looking: what is not known is not in it.

    Args:
        perception: what looks.
        loop: holds the arm, whose pose is needed to look past it.
        truth: what a simulated world gives away to perceptions that take it; None where there is none.
        meanwhile: called between two looks.
        now_ns: this process's monotonic clock.
    """

    def __init__(
        self, perception: Perceives, loop: _Measures, *, truth: SceneTruth | None = None,
        meanwhile: Callable[[], object] = lambda: None, now_ns: Callable[[], int] = monotonic_ns,
    ) -> None:  # fmt: skip
        self._perception, self._loop, self._truth = perception, loop, truth
        self._meanwhile, self._now_ns = meanwhile, now_ns

    def read(self) -> SceneState:
        """Forget the table before and look at the one that there is now.

        Raises:
            WireError: nothing is perceived, or the arm cannot be read.
        """
        if isinstance(self._perception, Sighted):
            self._perception.forget()
        end_ns = self._now_ns() + LOOK_NS
        percept = self._look_once_more(end_ns)
        while not all(thing.is_valid for thing in percept.objects) and self._now_ns() < end_ns:
            self._meanwhile()
            percept = self._look_once_more(end_ns)
        seen = [thing for thing in percept.objects if thing.is_valid]
        return SceneState(
            stamp_ns=percept.stamp_ns,
            objects=tuple([ObjectPose(name=t.name, position_m=t.position_m, quat=t.quat) for t in seen]),
        )

    def _look_once_more(self, end_ns: int) -> Percept:
        """Look until there is a percept that is not too old: one that is late now and then is no blind camera."""
        while True:
            try:
                return self._look()
            except StaleStateError:
                if self._now_ns() >= end_ns:
                    raise
            self._meanwhile()

    def _look(self) -> Percept:
        truth = self._truth
        return self._perception.perceive(self._loop.measure(), None if truth is None else truth.read())
