"""Paths of the set-point: a straight line of joints, a straight line and a circle of the tool. Pure."""

import math
from typing import Protocol

import numpy as np

from sim_twin.controller.motion.kinematics import ArmKinematics
from sim_twin.controller.motion.poses import Array, between, rotation

__all__ = ["ArcPath", "JointPath", "LinePath", "Path", "PathError", "ToolPath", "TrackedPath"]

TURN_M_PER_RAD = 0.2
"""A turn of one radian counts as this far for a move's speed: UR does not say how fast a mere turn goes."""
COLLINEAR = 1e-6
CHECK_M = 0.03
"""A path is walked in steps of this length before it begins; each costs about 60 us of the first slice."""


CHECK_RAD = 0.1
"""A joint path's tool is looked at in steps of this turn."""


class PathError(ValueError):
    """The way-points make no path."""


class Path(Protocol):
    """What a move follows."""

    length: float
    """In the unit that its speed is given in."""
    end_rad: Array
    """The joints that it leads to."""
    rates: Array
    """How far each joint turns at most, in a unit of its length."""

    def at(self, s: float) -> Array:
        """Return the joints at a distance from its start; distances must not jump.  () -> (6,)"""
        ...


class ToolPath(Protocol):
    """Where the tool goes."""

    length: float

    def at(self, s: float) -> Array:
        """Return T_bt at a distance from the start.  () -> (4, 4)"""
        ...


class JointPath:
    """All joints in proportion; its length is the leading joint's turn, in radians."""

    def __init__(self, start_rad: Array, end_rad: Array) -> None:
        self._start, self.end_rad = start_rad, end_rad
        self.length = float(np.abs(end_rad - start_rad).max())
        self._rates = (end_rad - start_rad) / self.length if self.length else np.zeros(6)
        self.rates: Array = np.abs(self._rates)

    def tool_rate(self, kinematics: ArmKinematics, T_ft: Array) -> float:
        """Return how far the tool goes at most while the leading joint turns by one radian (m), sampled."""
        n = max(1, math.ceil(self.length / CHECK_RAD))
        return max(
            kinematics.tool_speed(self._start + self.length * k / n * self._rates, self._rates, T_ft)
            for k in range(n + 1)
        )

    def at(self, s: float) -> Array:
        """Return the joints at a turn of the leading joint.  () -> (6,)"""
        return self.end_rad if s >= self.length else self._start + s * self._rates


class LinePath:
    """The tool straight from one pose to another, turning evenly; its length is in metres."""

    def __init__(self, T_start: Array, T_end: Array) -> None:
        self._T_start = T_start
        self._way, self._turn = between(T_start, T_end)
        angle = float(np.linalg.norm(self._turn))
        self.length = max(float(np.linalg.norm(self._way)), TURN_M_PER_RAD * angle)

    def at(self, s: float) -> Array:
        """Return T_bt at a distance from the start.  () -> (4, 4)"""
        share = s / self.length if self.length else 0.0
        T = self._T_start.copy()
        T[:3, 3] += share * self._way
        T[:3, :3] = rotation(share * self._turn) @ T[:3, :3]
        return T


class ArcPath:
    """The tool on the circle through three points; its length is the arc's, in metres.

    Args:
        T_start: First pose.
        via_m: A point on the way; its orientation does not count, as UR says.
        T_end: Last pose.
        is_fixed: Keep the tool's turn against the tangent (URScript's mode 1); else it turns evenly to the last pose.

    Raises:
        PathError: the three points lie on one line or on one another.
    """

    def __init__(self, T_start: Array, via_m: Array, T_end: Array, *, is_fixed: bool = False) -> None:
        a, b, c = T_start[:3, 3], np.asarray(via_m, dtype=np.float64), T_end[:3, 3]
        normal = np.cross(b - a, c - a)
        area = float(np.linalg.norm(normal))
        if area <= COLLINEAR * float(np.linalg.norm(b - a)) * float(np.linalg.norm(c - a)) or area == 0.0:
            raise PathError(f"circle: expected three points that are not on one line, got {a}, {b}, {c}; use movel")
        self._axis = normal / area
        self.centre_m = a + _centre_from(b - a, c - a, normal)
        self._arm = a - self.centre_m
        self.radius_m = float(np.linalg.norm(self._arm))
        self._angle = _angle_about(self._axis, self._arm, c - self.centre_m)
        self.length = self.radius_m * self._angle
        self._R_start = T_start[:3, :3]
        turn = between(T_start, T_end)[1]
        self._turn = self._axis * self._angle if is_fixed else turn

    def at(self, s: float) -> Array:
        """Return T_bt at a distance along the arc.  () -> (4, 4)"""
        share = s / self.length
        T = np.eye(4)
        T[:3, :3] = rotation(share * self._turn) @ self._R_start
        T[:3, 3] = self.centre_m + rotation(share * self._angle * self._axis) @ self._arm
        return T


class TrackedPath:
    """A tool's path as joints, each solved from the one before, so that the arm never changes its branch.

    Args:
        path: The tool's path.
        start_rad: Joints at its start.
        kinematics: Of the arm.
        T_ft: The tool.

    Raises:
        KinematicsError: it leads out of reach or through a singular pose; found before anything moves.
    """

    N_CHECKS = 32

    def __init__(self, path: ToolPath, start_rad: Array, kinematics: ArmKinematics, T_ft: Array) -> None:
        self.length = path.length
        self._path, self._kinematics, self._T_ft = path, kinematics, T_ft
        self._last = start_rad
        self.rates: Array = np.zeros(6)
        self.end_rad = self._walk() if path.length else start_rad
        self._last = start_rad

    def at(self, s: float) -> Array:
        """Return the joints at a distance from the start, near the last one asked for.  () -> (6,)"""
        if self.length:
            self._last = self._kinematics.refine(self._path.at(s), self._last, self._T_ft)
        return self._last

    def _walk(self) -> Array:
        n = max(4, min(self.N_CHECKS, math.ceil(self.length / CHECK_M)))
        for k in range(1, n + 1):
            before = self._last
            turned = np.abs(self.at(self.length * k / n) - before)
            self.rates = np.maximum(self.rates, turned * n / self.length)
        return self._last


def _centre_from(u: Array, v: Array, normal: Array) -> Array:
    """Return the circle's centre, seen from its first point, for the ways to the other two."""
    return np.cross(float(u @ u) * v - float(v @ v) * u, normal) / (2.0 * float(normal @ normal))


def _angle_about(axis: Array, start: Array, end: Array) -> float:
    angle = math.atan2(float(axis @ np.cross(start, end)), float(start @ end))
    return angle if angle > 0.0 else angle + 2.0 * math.pi
