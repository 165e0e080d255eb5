"""servoj's smoothing: a filter whose lag, with that of the twin's own servo, is robot.servo.lag_s."""

import numpy as np

from robot.servo import lag_s
from sim_twin.controller.motion.poses import Array

__all__ = ["ServoFilter", "filter_lag_s", "limited"]

LOOKAHEAD_S = (0.03, 0.2)
GAIN = (100.0, 2000.0)
JUMP_S = 0.05
"""At full speed for this long, beyond the lag: a target further away is refused. UR's own rule is not published."""


def filter_lag_s(*, lookahead_s: float, gain: float, dead_time_s: float, servo_lag_s: float) -> float:
    """Return what the filter must add to the lag of the servo behind it; nothing where that is slower than the law.

    Raises:
        ValueError: look-ahead or gain outside UR's ranges.
    """
    if not LOOKAHEAD_S[0] <= lookahead_s <= LOOKAHEAD_S[1]:
        raise ValueError(f"servoj lookahead_time: expected {LOOKAHEAD_S[0]} to {LOOKAHEAD_S[1]} s, got {lookahead_s}")
    if not GAIN[0] <= gain <= GAIN[1]:
        raise ValueError(f"servoj gain: expected {GAIN[0]:g} to {GAIN[1]:g}, got {gain}")
    return max(0.0, lag_s(lookahead_s=lookahead_s, gain=gain, dead_time_s=dead_time_s) - servo_lag_s)


class ServoFilter:
    """Two equal first-order stages in implicit steps: a ramp is trailed by exactly the lag, without overshoot.

    No joint is set to go faster than it may: targets that come in steps, or short looks ahead, lead to no jump.

    Args:
        q_rad: Where the set-point is.
        qd_rad_s: How fast it moves; it goes on at this speed and bends towards the target.
        lag_s: How far a ramp is trailed.
        speed_rad_s: Greatest speed of each joint.
    """

    def __init__(self, q_rad: Array, qd_rad_s: Array, lag_s: float, *, speed_rad_s: Array) -> None:
        self._speed = speed_rad_s
        self._stage_s = lag_s / 2.0
        self.lag_s = lag_s
        self.seat(q_rad, qd_rad_s)

    def seat(self, q_rad: Array, qd_rad_s: Array) -> None:
        """Go on from somewhere else.  (6,), (6,)"""
        self._out = q_rad
        self._middle = q_rad + qd_rad_s * self._stage_s

    def step(self, target_rad: Array, dt_s: float) -> Array:
        """Advance by a time and return the set-point.  (6,) -> (6,)"""
        share = dt_s / (dt_s + self._stage_s) if dt_s > 0.0 else 0.0
        self._middle = self._middle + share * (target_rad - self._middle)
        self._out = limited(self._out, self._out + share * (self._middle - self._out), self._speed * dt_s)
        return np.array(self._out)

    def is_far(self, target_rad: Array) -> bool:
        """Whether a target is further than smoothing could bring about: that is a jump, not a motion.  (6,)"""
        reach = self._speed * (self.lag_s + JUMP_S)
        return bool((np.abs(target_rad - self._out) > reach).any())


def limited(start: Array, end: Array, step: Array) -> Array:
    """Return the end, or the point on the way to it that no joint's step passes.  (6,), (6,), (6,) -> (6,)"""
    way = end - start
    if not (np.abs(way) > step).any():
        return end
    return start + way * float(np.min(step / np.maximum(np.abs(way), step)))
