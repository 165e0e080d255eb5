"""A clock that tells a stopwatch how long the world itself took."""

from collections.abc import Callable

from robot.hal.protocols import Clock, Plant

__all__ = ["TimedClock", "time_world"]


class TimedClock:
    """Implements robot.hal.protocols.Clock around another clock."""

    def __init__(self, clock: Clock, lap: Callable[[str], None]) -> None:
        self._clock = clock
        self._lap = lap

    def now_ns(self) -> int:
        """Return the time of the arm."""
        return self._clock.now_ns()

    def wait_tick(self) -> int:
        """Wait for the next tick; what went before is the stack's time, the wait is the world's (physics on a twin)."""
        self._lap("stack")
        n_missed = self._clock.wait_tick()
        self._lap("physics")
        return n_missed


def time_world(plant: Plant, lap: Callable[[str], None]) -> None:
    """Let a stopwatch's lap hear of every tick of a plant."""
    plant.arm.clock = TimedClock(plant.arm.clock, lap)
