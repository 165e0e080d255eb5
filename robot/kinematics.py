"""Where the tool is for given joints, and which joints bring it somewhere: placo on the arm's own model.

The forward path that runs every tick is robot.chain on the Denavit-Hartenberg rows; the inverse is placo on the MJCF
that the twin is built from. A test holds all of them together to 1e-6 m. Loops ask a closed form before placo, and a
test holds it to placo's answers.
"""

import math
import os
import tempfile
from operator import le
from pathlib import Path

import numpy as np
import placo

from config.arm import ArmConfig
from robot.chain import ToolChain
from robot.description import tool_down, write_mjcf
from robot.downward import TOLERANCE_M, DownwardArm
from robot.errors import RobotError
from robot.messages import Vec3, Vec6
from robot.stdio import redirected_stdout

__all__ = ["Kinematics", "UnreachableError"]

N_JOINTS = 6
NEAR = 1e-3
"""A step of the solver that begins this near (metres, radians) ends within tolerance: its error falls as the square."""
MAX_ITERATIONS = 40


class UnreachableError(RobotError, ValueError):
    """No joint angles within range bring the tool there."""


class Kinematics:
    """Inverse kinematics of one arm. Every call starts afresh: the same question has the same answer, bit for bit.

    Args:
        arm: The arm's file.
        is_swift: Ask the closed form first, where the arm has one. It agrees with placo to placo's own tolerance, not
            to the last digit.

    Attributes:
        downward: That closed form; None where it is not asked.
    """

    def __init__(self, arm: ArmConfig, *, is_swift: bool = False) -> None:
        self.downward = DownwardArm(arm) if is_swift and DownwardArm.fits(arm) else None
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
        if self.downward is not None:
            found = self.downward.near(position_m, self._yaw_rad if yaw_rad is None else yaw_rad, seed_rad)
            if found is not None:
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
        is_there = math.dist(self.chain.tcp(q_rad), position_m) <= TOLERANCE_M
        return is_there and all(map(le, self._low_rad, q_rad)) and all(map(le, q_rad, self._high_rad))

    def _set_yaw(self, yaw_rad: float) -> None:
        if yaw_rad != self._yaw_now_rad:
            self._T_bt[:3, :3] = tool_down(yaw_rad)
            self._yaw_now_rad = yaw_rad


def _load(arm: ArmConfig) -> placo.RobotWrapper:
    """Load the arm's MJCF; placo reads files only."""
    with tempfile.TemporaryDirectory(prefix="autotelic_") as folder:
        path = Path(folder) / "arm.xml"
        write_mjcf(arm, path)
        with open(os.devnull, "wb") as nowhere, redirected_stdout(nowhere.fileno()):  # placo prints from C++ on load
            return placo.RobotWrapper(str(path), placo.Flags.mjcf | placo.Flags.ignore_collisions)
