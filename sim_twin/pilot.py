"""A hand-written pilot that knows where everything is: drives a station with Heading intents for benches and tests.

It stands beside the learner, never inside it: same intents, same station, ground-truth positions.
"""

import math
from collections.abc import Callable

from robot.messages import Heading, Percept, StepResult, Vec3
from robot.station import Station

__all__ = ["Pilot"]

CLOSE_M = 5e-4
Until = Callable[[StepResult], bool]


class Pilot:
    """Moves the tool over things, down on them and up again, one time step after another.

    Attributes:
        percept: Newest percept.
        n_steps: Time steps since the reset.
    """

    def __init__(self, station: Station) -> None:
        self._station = station
        spec = station.spec
        self._longest = spec.max_step_m
        self.low_m, self.travel_m = spec.heights_m

    def reset(self, *, seed: int, epoch: int) -> Percept:
        """Lay the table out."""
        self.percept = self._station.reset(seed=seed, epoch=epoch)
        self._target = self.percept.tcp_position_m
        self.n_steps = 0
        return self.percept

    def where(self, name: str) -> Vec3:
        """Return an object's perceived position."""
        return next(o.position_m for o in self.percept.objects if o.name == name)

    def step(self, *, heading_rad: float = 0.0, distance_m: float = 0.0, height_m: float | None = None) -> StepResult:
        """Take one time step, at travel height unless told otherwise."""
        intent = Heading(
            heading_rad=heading_rad, distance_m=distance_m, height_m=self.travel_m if height_m is None else height_m
        )
        result = self._station.step(intent)
        self.percept, self._target = result.percept, result.executed.target_m
        self.n_steps += 1
        return result

    def go(self, x: float, y: float, *, limit: int = 100) -> bool:
        """Bring the target over a point at travel height; return whether it got there within the limit."""
        for _ in range(limit):
            dx, dy = x - self._target[0], y - self._target[1]
            away = math.hypot(dx, dy)
            if away < CLOSE_M and self._target[2] > self.travel_m - CLOSE_M:
                return True
            self.step(heading_rad=math.atan2(dy, dx), distance_m=min(away, self._longest))
        return False

    def down(self, until: Until, *, limit: int = 60) -> bool:
        """Go straight down until something holds; return whether it did."""
        return any(until(self.step(height_m=self.low_m)) for _ in range(limit))

    def rest(self, n_steps: int = 6) -> None:
        """Let the arm come to rest on its target."""
        height = self._target[2] - self._station.spec.table_height_m
        for _ in range(n_steps):
            self.step(height_m=height)
