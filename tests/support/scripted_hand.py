"""A scripted driver that knows where everything is: what a person with a joystick does, by Heading intents."""

import math

from robot.messages import Heading
from robot.station import Station

NEAR_M = 0.004
TRAVEL_STEPS = 60
DESCENT_STEPS = 25
LIFT_STEPS = 14


class ScriptedHand:
    """Presses, grabs and puts by Heading intents alone."""

    def __init__(self, station: Station, *, seed: int, epoch: int) -> None:
        self._station = station
        self._low_m, self._high_m = station.spec.heights_m
        self.percept = station.reset(seed=seed, epoch=epoch)
        self._target_m = self.percept.tcp_position_m
        self.refusals = []

    def press(self, button: int, name: str) -> bool:
        """Press a button from above until its lamp is lit; return whether it is."""
        self._over(name)
        self._down_on(name, until=lambda: self.percept.button_states[button] > 0.5)
        self._lift()
        return self.percept.button_states[button] > 0.5

    def grab(self, name: str) -> bool:
        """Take a cylinder and lift it; return whether it is in the hand."""
        self._over(name)
        self._down_on(name, until=lambda: self.percept.grip.has_object)
        self._lift()
        return self.percept.grip.has_object and self._distance_m(name, self.percept.tcp_position_m) < NEAR_M * 10

    def put(self, name: str, box: str) -> bool:
        """Carry what is held over a box and let go; return whether it lies in there."""
        self._over(box)
        self._down_on(box, until=lambda: not self.percept.grip.has_object)
        self._lift()
        x, y, z = self.where(name)
        box_x, box_y, _ = self.where(box)
        return max(abs(x - box_x), abs(y - box_y)) < 0.09 and z < 0.1 and not self.percept.grip.has_object

    def where(self, name: str) -> tuple[float, float, float]:
        """Return where a thing is, base frame (m)."""
        return next(thing.position_m for thing in self.percept.objects if thing.name == name)

    def _over(self, name: str) -> None:
        self._lift()
        for _ in range(TRAVEL_STEPS):
            if self._distance_m(name, self.percept.tcp_position_m) < NEAR_M:
                return
            self._step(towards=name, height_m=self._high_m)

    def _down_on(self, name: str, *, until) -> None:
        for _ in range(DESCENT_STEPS):
            if until():
                return
            self._step(towards=name, height_m=self._low_m)

    def _lift(self) -> None:
        for _ in range(LIFT_STEPS):
            if self._target_m[2] >= self._high_m - NEAR_M and self.percept.tcp_position_m[2] >= self._high_m - NEAR_M:
                return
            self._step(towards=None, height_m=self._high_m)

    def _step(self, *, towards: str | None, height_m: float) -> None:
        """One intent, measured from the shaped target, since the arm lags behind it."""
        heading_rad = distance_m = 0.0
        if towards is not None:
            dx, dy = (self.where(towards)[i] - self._target_m[i] for i in range(2))
            heading_rad, distance_m = math.atan2(dy, dx), min(math.hypot(dx, dy), self._station.spec.max_step_m)
        result = self._station.step(Heading(heading_rad=heading_rad, distance_m=distance_m, height_m=height_m))
        self.percept, self._target_m = result.percept, result.executed.target_m
        self.refusals += [verdict for verdict in result.verdicts if verdict.is_latched]

    def _distance_m(self, name: str, position_m) -> float:
        return math.dist(self.where(name)[:2], position_m[:2])
