"""Trapezoidal speed along a path, and the residual of a motion that another one takes over. Pure."""

import math

import numpy as np

from sim_twin.controller.motion.poses import Array

__all__ = ["Residual", "Trapezoid", "way_back"]

BACK_RAD_S2 = 1.4
"""Greatest acceleration of coming back onto a path after a stop."""


class Trapezoid:
    """Rest to rest over a distance: speed up at a, keep v, slow down at a. Any unit of length.

    Args:
        distance: How far, not negative.
        v: Greatest speed.
        a: Acceleration.
        duration_s: Overrides v: the speed that takes exactly this long at a, and a steeper a where a is too low for it.
    """

    def __init__(self, distance: float, *, v: float, a: float, duration_s: float = 0.0) -> None:
        if not (distance >= 0.0 and v > 0.0 and a > 0.0 and math.isfinite(distance + v + a + duration_s)):
            raise ValueError(f"speed profile: expected distance >= 0, v > 0, a > 0; got {distance}, {v}, {a}")
        self.distance = distance
        if duration_s > 0.0 and distance > 0.0:
            a = max(a, 4.0 * distance / duration_s**2)
            v = (a * duration_s - math.sqrt(max(0.0, (a * duration_s) ** 2 - 4.0 * a * distance))) / 2.0
        self.a = a
        self.v = min(v, math.sqrt(distance * a))
        self._ramp_s = self.v / a
        self._cruise_s = distance / self.v - self._ramp_s if self.v > 0.0 else 0.0
        self.duration_s = 2.0 * self._ramp_s + self._cruise_s

    def at(self, t_s: float) -> tuple[float, float, float]:
        """Return distance, speed and acceleration at a time."""
        if t_s <= 0.0 or self.distance == 0.0:
            return 0.0, 0.0, self.a if self.distance and t_s == 0.0 else 0.0
        if t_s < self._ramp_s:
            return 0.5 * self.a * t_s * t_s, self.a * t_s, self.a
        if t_s < self._ramp_s + self._cruise_s:
            return self.v * (t_s - self._ramp_s / 2.0), self.v, 0.0
        left = self.duration_s - t_s
        if left <= 0.0:
            return self.distance, 0.0, 0.0
        return self.distance - 0.5 * self.a * left * left, self.a * left, -self.a


class Residual:
    """What is left of a motion that another takes over: an offset and a speed that go to zero along a cubic.

    Over T = -2 offset / speed the cubic is the parabola of constant deceleration, so that two straight moves blend on
    a parabola that leaves one line at the blend radius and joins the other.

    Args:
        offset: Where the set-point is, seen from the new motion's start.  (6,)
        speed: How fast it moves.  (6,)
        duration_s: T.
        gear: How much faster its time passes than that of paths, where that is slowed down.
    """

    def __init__(self, offset: Array, speed: Array, duration_s: float, gear: float = 1.0) -> None:
        self.duration_s, self.gear = duration_s, gear
        self._offset, self._speed = offset, speed
        T = duration_s
        self._c2 = -(3.0 * offset + 2.0 * T * speed) / T**2 if T > 0.0 else np.zeros_like(offset)
        self._c3 = (2.0 * offset + T * speed) / T**3 if T > 0.0 else np.zeros_like(offset)

    def rate(self, pace: float) -> float:
        """Return how fast its time passes at a pace: never faster than the clock."""
        return min(1.0, self.gear * pace) if math.isfinite(self.gear) else 1.0

    def at(self, t_s: float) -> tuple[Array, Array, Array] | None:
        """Return offset, speed and acceleration at a time, or None when nothing is left.  () -> (6,), (6,), (6,)"""
        if t_s >= self.duration_s:
            return None
        q = self._offset + t_s * (self._speed + t_s * (self._c2 + t_s * self._c3))
        qd = self._speed + t_s * (2.0 * self._c2 + 3.0 * t_s * self._c3)
        return q, qd, 2.0 * self._c2 + 6.0 * t_s * self._c3


def way_back(offset: Array) -> Residual:
    """Return the way back onto a path from an offset, from rest.  (6,) -> Residual"""
    return Residual(offset, np.zeros(6), max(0.2, float(np.sqrt(6.0 * np.abs(offset).max() / BACK_RAD_S2))))
