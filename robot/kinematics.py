"""Where the tool is for given joints, and which joints bring it somewhere: placo on the arm's own model.

The forward path that runs every tick is plain floats on the Denavit-Hartenberg rows (about 1 us); the inverse is placo
on the MJCF that the twin is built from. A test holds all of them together to 1e-6 m. Loops ask a closed form before
placo, and a test holds it to placo's answers.
"""

import math
import os
import tempfile
from operator import le
from pathlib import Path

import numpy as np
import placo

from config.arm import ArmConfig
from config.posture import elbow_point
from robot.description import tool_down, write_mjcf
from robot.downward import DownwardArm
from robot.errors import RobotError
from robot.messages import Quat, Vec3, Vec6
from robot.stdio import redirected_stdout

__all__ = ["Kinematics", "ToolChain", "UnreachableError"]

N_JOINTS = 6
N_TO_ELBOW = 2
"""Joints that move the elbow."""
TOLERANCE = 1e-5
"""A solution is off by no more than this, in metres."""
NEAR = 1e-3
"""A step of the solver that begins this near (metres, radians) ends within tolerance: its error falls as the square."""
MAX_ITERATIONS = 40
NEIGHBOUR_RAD = 0.2
"""The closed form keeps to its seed's side of shoulder, elbow and wrist: farther off the nearest may be others."""


class UnreachableError(RobotError, ValueError):
    """No joint angles within range bring the tool there."""


class ToolChain:
    """Forward kinematics of the tool's axis in plain floats, for the loops that run every tick.

    A point is carried down the chain row by row: p_i-1 = Rz(q_i) Tz(d_i) Tx(a_i) Rx(alpha_i) p_i.
    """

    def __init__(self, arm: ArmConfig) -> None:
        rows = [(j.a_m, j.d_m, math.cos(j.alpha_rad), math.sin(j.alpha_rad)) for j in arm.joints]
        self._rows = tuple(reversed(rows))
        self._half_twists = tuple((math.cos(j.alpha_rad / 2), math.sin(j.alpha_rad / 2)) for j in arm.joints)
        self._tcp = arm.tool.tcp_m
        x, y, z = arm.tool.tcp_m
        self._tip = (x, y, z + arm.tool.tip_below_tcp_m)
        self._tip_m = arm.tool.tip_below_tcp_m
        self._is_axial = x == y == 0.0 < z
        self._elbow = elbow_point(arm)
        self._finger_m = arm.tool.stroke_m / 2 + arm.tool.pad_size_m[0]
        self._is_plain = self._is_axial and DownwardArm.fits(arm)
        j = arm.joints
        self._plain = (j[0].d_m, j[1].a_m, j[2].a_m, j[3].d_m, j[4].d_m, j[5].d_m, z)

    def tcp(self, q_rad: Vec6) -> Vec3:
        """Return the tool centre point for joint angles, base frame, metres."""
        x, y, z = self._tcp
        i = N_JOINTS
        for a, d, ca, sa in self._rows:
            i -= 1
            s, c = math.sin(q_rad[i]), math.cos(q_rad[i])
            u, v = x + a, ca * y - sa * z
            x, y, z = c * u - s * v, s * u + c * v, sa * y + ca * z + d
        return x, y, z

    def tcp_and_tip(self, q_rad: Vec6) -> tuple[Vec3, Vec3]:
        """Return the tool centre point and the point between the fingertips, base frame, metres."""
        x, y, z = self._tcp
        tx, ty, tz = self._tip
        i = N_JOINTS
        for a, d, ca, sa in self._rows:
            i -= 1
            s, c = math.sin(q_rad[i]), math.cos(q_rad[i])
            u, v = x + a, ca * y - sa * z
            x, y, z = c * u - s * v, s * u + c * v, sa * y + ca * z + d
            u, v = tx + a, ca * ty - sa * tz
            tx, ty, tz = c * u - s * v, s * u + c * v, sa * ty + ca * tz + d
        return (x, y, z), (tx, ty, tz)

    def tcp_and_lowest(self, q_rad: Vec6) -> tuple[Vec3, float]:
        """Return the tool centre point and the height of the lowest fingertip of an open hand, base frame, metres."""
        (tcp, _, _), down = self.points(q_rad)
        return tcp, self.lowest_m(tcp, down)

    def points(self, q_rad: Vec6) -> tuple[tuple[Vec3, Vec3, Vec3], float]:
        """Return tool centre point, flange and elbow, base frame, metres, and how far the tool points down, -1 to 1.

        The last is the cosine of the angle between the approach axis and straight down.
        """
        if self._is_plain:
            return self._plain_points(q_rad)
        x, y, z = self._tcp
        fx = fy = fz = ex = ey = ez = 0.0
        i = N_JOINTS
        for a, d, ca, sa in self._rows:
            i -= 1
            s, c = math.sin(q_rad[i]), math.cos(q_rad[i])
            u, v = x + a, ca * y - sa * z
            x, y, z = c * u - s * v, s * u + c * v, sa * y + ca * z + d
            u, v = fx + a, ca * fy - sa * fz
            fx, fy, fz = c * u - s * v, s * u + c * v, sa * fy + ca * fz + d
            if i < N_TO_ELBOW:
                if i == N_TO_ELBOW - 1:
                    ex, ey, ez = self._elbow
                u, v = ex + a, ca * ey - sa * ez
                ex, ey, ez = c * u - s * v, s * u + c * v, sa * ey + ca * ez + d
        down = (fz - z) / self._tcp[2] if self._is_axial else (z - self.tcp_and_tip(q_rad)[1][2]) / self._tip_m
        return ((x, y, z), (fx, fy, fz), (ex, ey, ez)), down

    def _plain_points(self, q_rad: Vec6) -> tuple[tuple[Vec3, Vec3, Vec3], float]:
        """Return the same for an arm of the UR family, its three parallel joints taken together.

        The rows multiplied out, as in Hawkins 2013, "Analytic Inverse Kinematics for the Universal Robots
        UR-5/UR-10 Arms"; the tool centre point lies on the flange's axis.
        """
        sin, cos = math.sin, math.cos
        q1, q2, q3, q4, q5, _ = q_rad
        d1, a2, a3, d4, d5, d6, tcp_m = self._plain
        q23 = q2 + q3
        s1, c1, s2, c2, s5 = sin(q1), cos(q1), sin(q2), cos(q2), sin(q5)
        s234, c234 = sin(q23 + q4), cos(q23 + q4)
        ahead, aside, up = -c234 * s5, cos(q5), -s234 * s5  # of the approach axis, in the arm's plane and across it
        ax, ay = c1 * ahead + s1 * aside, s1 * ahead - c1 * aside
        out = a2 * c2 + a3 * cos(q23) + d5 * s234
        x, y = c1 * out + s1 * d4 + d6 * ax, s1 * out - c1 * d4 + d6 * ay
        z = d1 + a2 * s2 + a3 * sin(q23) - d5 * c234 + d6 * up
        ex, ey, ez = self._elbow
        eu, ev = c2 * (ex + a2) - s2 * ey, s2 * (ex + a2) + c2 * ey
        elbow = (c1 * eu + s1 * ez, s1 * eu - c1 * ez, d1 + ev)
        return ((x + tcp_m * ax, y + tcp_m * ay, z + tcp_m * up), (x, y, z), elbow), -up

    def lowest_m(self, tcp_m: Vec3, down: float) -> float:
        """Return the height of the lowest fingertip of an open hand, metres, from what `points` returns.

        A tilted tool's lower finger hangs below the point between the tips by its reach times the sine of the tilt.
        """
        return tcp_m[2] - down * self._tip_m - self._finger_m * math.sqrt(max(0.0, 1.0 - down * down))

    def quat(self, q_rad: Vec6) -> Quat:
        """Return the tool's turn, scalar first: the product of Rz(q_i) Rx(alpha_i) as unit quaternions."""
        w, x, y, z = 1.0, 0.0, 0.0, 0.0
        for q, (ca, sa) in zip(q_rad, self._half_twists, strict=True):
            c, s = math.cos(q / 2), math.sin(q / 2)
            w, x, y, z = c * w - s * z, c * x + s * y, c * y - s * x, c * z + s * w
            w, x, y, z = ca * w - sa * x, ca * x + sa * w, ca * y + sa * z, ca * z - sa * y
        return w, x, y, z


class Kinematics:
    """Inverse kinematics of one arm. Every call starts afresh: the same question has the same answer, bit for bit.

    Args:
        arm: The arm's file.
        is_swift: Ask the closed form first, where the arm has one. It agrees with placo to placo's own tolerance, not
            to the last digit.
    """

    def __init__(self, arm: ArmConfig, *, is_swift: bool = False) -> None:
        self._downward = DownwardArm(arm) if is_swift and DownwardArm.fits(arm) else None
        self.chain = ToolChain(arm)
        self._yaw_rad = arm.tool_yaw_rad
        self._low_rad, self._high_rad = zip(*(j.range_rad for j in arm.joints), strict=True)
        self._robot = _load(arm)
        self._offset = self._robot.get_joint_offset(arm.joints[0].name)
        self._rest_q = np.zeros(len(self._robot.state.q))
        self._solver = placo.KinematicsSolver(self._robot)
        if self._offset:
            # placo gives a model without joint at its root a floating base, at a random pose until it is told.
            self._rest_q[self._offset - 1] = 1.0
            self._solver.mask_fbase(True)
        for name in self._robot.joint_names():
            if name not in {j.name for j in arm.joints}:
                self._solver.mask_dof(name)
        self._T_bt = np.eye(4)
        self._T_bt[:3, :3] = tool_down(self._yaw_rad)
        self._yaw_now_rad = self._yaw_rad
        self._task = self._solver.add_frame_task("tcp", self._T_bt)
        self._task.configure("tcp", "soft", 1.0, 1.0)
        self._position, self._orientation = self._task.position(), self._task.orientation()

    def tcp(self, q_rad: Vec6) -> Vec3:
        """Return the tool centre point for joint angles, base frame, metres."""
        return self.chain.tcp(q_rad)

    def solve(self, position_m: Vec3, seed_rad: Vec6, *, yaw_rad: float | None = None) -> Vec6:
        """Return the joint angles nearest a seed that bring the tool, pointing down, to a position.

        Args:
            position_m: Tool centre point, base frame.
            seed_rad: Where to start from; a neighbour of the answer.
            yaw_rad: Turn of the tool about the vertical; the arm's own where absent.

        Raises:
            UnreachableError: nothing within range comes closer than the tolerance.
        """
        if self._downward is not None:
            found = self._downward.solve(position_m, self._yaw_rad if yaw_rad is None else yaw_rad, seed_rad)
            if found is not None and self._is_answer(found, position_m) and _are_neighbours(found, seed_rad):
                return found
        self._set_yaw(self._yaw_rad if yaw_rad is None else yaw_rad)
        T_bt, robot, lo = self._T_bt, self._robot, self._offset
        T_bt[0, 3], T_bt[1, 3], T_bt[2, 3] = position_m
        q = self._rest_q.copy()
        q[lo : lo + N_JOINTS] = seed_rad
        robot.state.q = q
        self._task.T_world_frame = T_bt
        is_solved = self._iterate()
        x = robot.state.q[lo : lo + N_JOINTS].tolist()
        solution: Vec6 = (x[0], x[1], x[2], x[3], x[4], x[5])
        if is_solved and self._is_answer(solution, position_m):
            return solution
        raise UnreachableError(f"no joint angles within range reach {position_m} m with the tool pointing down")

    def _iterate(self) -> bool:
        """Run the solver until a step began so near that it ended within tolerance; whether it got there."""
        robot, solver = self._robot, self._solver
        for _ in range(MAX_ITERATIONS):
            robot.update_kinematics()
            try:
                solver.solve(True)
            except RuntimeError:  # placo's QPError: a seed outside the joint ranges has no feasible step
                return False
            # These are the errors that the step began with; it leaves about their square.
            if self._position.error_norm() < NEAR and self._orientation.error_norm() < NEAR:
                return True
        return False

    def _is_answer(self, q_rad: Vec6, position_m: Vec3) -> bool:
        """Whether joints are within range and lead there. Asked this way round, what is not a number does not."""
        is_there = math.dist(self.chain.tcp(q_rad), position_m) <= TOLERANCE
        return is_there and all(map(le, self._low_rad, q_rad)) and all(map(le, q_rad, self._high_rad))

    def _set_yaw(self, yaw_rad: float) -> None:
        if yaw_rad != self._yaw_now_rad:
            self._T_bt[:3, :3] = tool_down(yaw_rad)
            self._yaw_now_rad = yaw_rad


def _are_neighbours(a: Vec6, b: Vec6) -> bool:
    return max([abs(u - v) for u, v in zip(a, b, strict=True)]) <= NEIGHBOUR_RAD


def _load(arm: ArmConfig) -> placo.RobotWrapper:
    """Load the arm's MJCF; placo reads files only."""
    with tempfile.TemporaryDirectory(prefix="autotelic_") as folder:
        path = Path(folder) / "arm.xml"
        write_mjcf(arm, path)
        with open(os.devnull, "wb") as nowhere, redirected_stdout(nowhere.fileno()):  # placo prints from C++ on load
            return placo.RobotWrapper(str(path), placo.Flags.mjcf | placo.Flags.ignore_collisions)
