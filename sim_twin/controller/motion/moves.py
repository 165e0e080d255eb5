"""movej, movel, movep, movec and servoc: paths with trapezoidal speed and blends."""

import math
from collections.abc import Sequence

import numpy as np

from sim_twin.controller.motion.core import Motion, MotionCore, Tail
from sim_twin.controller.motion.kinematics import KinematicsError
from sim_twin.controller.motion.paths import TURN_M_PER_RAD, ArcPath, JointPath, LinePath, Path, ToolPath, TrackedPath
from sim_twin.controller.motion.poses import Array, matrix_from_pose, pose_from_matrix, vec6
from sim_twin.controller.motion.profiles import Residual, Trapezoid
from sim_twin.controller.motion.setpoint import USED_SPEED

__all__ = ["Moves"]

Numbers = Sequence[float] | Array
TOOL_M_S = 3.0 * USED_SPEED
"""Greatest speed of the tool on a path: what UR's clients take for it, where the default safety limit is, less what the
servos overshoot."""
NO_RATE = 1e-9


class Moves:
    """Generators that follow a path; resume one once a slice.

    A move with a blend radius returns as soon as the tool is within it; what is left goes on as a tail, and the next
    move, begun in that same slice, blends. Half of the move's own length is the most that a radius counts for.

    No joint is sent faster or accelerated harder than the arm's file allows, nor the tool faster than its limit,
    whatever speed, acceleration or time a move is given: it takes longer then. What a tool's path asks of the joints is
    sampled along it.

    Args:
        core: What motions share.
    """

    def __init__(self, core: MotionCore) -> None:
        self._core = core

    def movej(
        self, target: Numbers, a: float = 1.4, v: float = 1.05, t: float = 0.0, r: float = 0.0, *, is_pose: bool = False
    ) -> Motion:
        """Move all joints in proportion to joint angles, or to a UR pose where is_pose says so.

        Raises:
            NoSolutionError: the pose is out of reach.
        """
        core = self._core
        _check(a, v)
        end = core.joints_of(target) if is_pose else vec6(target)
        start, residual = core.begin(lambda speed: float(np.abs(speed).max()) / a)
        yield from self._run(JointPath(start, end), (v, a, t), residual, start, r)

    def movel(
        self, target: Numbers, a: float = 1.2, v: float = 0.25, t: float = 0.0, r: float = 0.0, *, is_pose: bool = True
    ) -> Motion:
        """Move the tool straight to a UR pose, or to where joint angles bring it.

        Raises:
            KinematicsError: the line leads out of reach or through a singular pose; nothing has moved.
        """
        core = self._core
        _check(a, v)
        T_end = matrix_from_pose(vec6(target, "pose")) if is_pose else core.tool_at(vec6(target))
        start, residual = core.begin(lambda speed: self._tool_ramp_s(speed, a))
        yield from self._along(LinePath(core.tool_at(start), T_end), (v, a, t), residual, start, r)

    def movep(
        self, target: Numbers, a: float = 1.2, v: float = 0.25, r: float = 0.0, *, is_pose: bool = True
    ) -> Motion:
        """Move the tool straight and blend: as movel, without a time.

        UR blends movep on circles at constant tool speed; here its blends are movel's parabolas.
        """
        return self.movel(target, a, v, 0.0, r, is_pose=is_pose)

    def servoc(
        self, target: Numbers, a: float = 1.2, v: float = 0.25, r: float = 0.0, *, is_pose: bool = True
    ) -> Motion:
        """Servo the tool towards a pose; the next servoc takes over within r: as movep."""
        return self.movel(target, a, v, 0.0, r, is_pose=is_pose)

    def movec(
        self, via: Numbers, target: Numbers, a: float = 1.2, v: float = 0.25, r: float = 0.0, mode: int = 0
    ) -> Motion:
        """Move the tool on the circle through a pose to another; mode 1 keeps its turn against the tangent.

        Raises:
            PathError: the three points lie on one line.
            KinematicsError: the circle leads out of reach or through a singular pose; nothing has moved.
        """
        core = self._core
        _check(a, v)
        via_m, T_end = vec6(via, "pose_via")[:3], matrix_from_pose(vec6(target, "pose_to"))
        start, residual = core.begin(lambda speed: self._tool_ramp_s(speed, a))
        path = ArcPath(core.tool_at(start), via_m, T_end, is_fixed=mode == 1)
        yield from self._along(path, (v, a, 0.0), residual, start, r)

    def _along(
        self, tool_path: ToolPath, vat: tuple[float, float, float], residual: Residual | None, start: Array, r: float
    ) -> Motion:
        try:
            path = TrackedPath(tool_path, start, self._core.kinematics, self._core.T_ft)
        except KinematicsError:
            # An end out of reach is the better reason.
            self._core.joints_of(pose_from_matrix(tool_path.at(tool_path.length)))
            raise
        yield from self._run(path, vat, residual, start, r)

    def _run(
        self, path: Path, vat: tuple[float, float, float], residual: Residual | None, start: Array, r: float
    ) -> Motion:
        core = self._core
        profile = _profile(path.length, vat, residual, self._most(path))
        following = core.follow(path, profile, residual)
        if r <= 0.0:
            yield from following
            return
        goal = core.tool_at(path.end_rad)[:3, 3]
        within = min(r, 0.5 * float(np.linalg.norm(goal - core.tool_at(start)[:3, 3])))
        for _ in following:
            yield
            if float(np.linalg.norm(core.tool_at(core.nominal_rad)[:3, 3] - goal)) <= within:
                core.tail = Tail(following, anchor_rad=path.end_rad)
                return

    def _most(self, path: Path) -> tuple[float, float]:
        """Return the greatest speed and acceleration along a path, in the unit of its length."""
        core = self._core
        rates = np.maximum(path.rates, NO_RATE)
        v, a = float(np.min(core.speed_rad_s / rates)), float(np.min(core.acceleration_rad_s2 / rates))
        tool_rate = path.tool_rate(core.kinematics, core.T_ft) if isinstance(path, JointPath) else 1.0
        return min(v, TOOL_M_S / max(tool_rate, NO_RATE)), a

    def _tool_ramp_s(self, speed: Array, a: float) -> float:
        twist = self._core.kinematics.jacobian(self._core.setpoint.q_target, self._core.T_ft) @ speed
        return max(float(np.linalg.norm(twist[:3])), TURN_M_PER_RAD * float(np.linalg.norm(twist[3:]))) / a


def _check(a: float, v: float) -> None:
    if not (0.0 < a < math.inf and 0.0 < v < math.inf):
        raise ValueError(
            f"move: expected finite acceleration and speed above 0, got a {a} and v {v}; nothing has moved"
        )


def _profile(
    length: float, vat: tuple[float, float, float], residual: Residual | None, most: tuple[float, float]
) -> Trapezoid:
    """Return the speed along a path; while a residual runs out no more speed comes in than goes out."""
    v, a, t = vat
    v, a = min(v, most[0]), min(a, most[1])
    if residual is not None:
        a = min(a, v / residual.duration_s)
    profile = Trapezoid(length, v=v, a=a, duration_s=t)
    if profile.v <= most[0] and profile.a <= most[1]:
        return profile
    v, a = most
    return Trapezoid(length, v=v, a=a if residual is None else min(a, v / residual.duration_s))
