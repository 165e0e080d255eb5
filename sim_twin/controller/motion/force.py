"""force_mode: along the compliant axes of a task frame the tool goes where the asked force is felt. Pure."""

import math
from collections.abc import Sequence
from enum import IntEnum

import msgspec
import numpy as np

from sim_twin.controller.motion.poses import Array, length, matrix_from_pose

__all__ = ["ForceKind", "ForceLaw", "ForceTask", "task_axes"]

SPEED_PER_FORCE = (0.0006, 0.0006, 0.0006, 0.03, 0.03, 0.03)
"""m/s per N and rad/s per Nm at gain scaling 1: slow enough for the fingertips' 8 N/mm behind 35 ms of lag."""
SMOOTHING_S = 0.012
BRAKE = (2.5, 10.0)
"""m/s² and rad/s² at which complying ends when the program is paused."""
STILL = 1e-4


class ForceKind(IntEnum):
    """How the task frame is read (URScript's type)."""

    POINT = 1
    """y axis from the tool towards the frame's origin."""
    FRAME = 2
    """As it is given."""
    MOTION = 3
    """x axis along the tool's motion in the frame's x-y plane."""


class ForceTask(msgspec.Struct, frozen=True, kw_only=True):
    """What force_mode was told. Wrench and limits in the task frame, force before torque."""

    frame: tuple[float, ...]
    is_compliant: tuple[bool, ...]
    wrench: tuple[float, ...]
    """Force (N) and torque (Nm) that the robot applies to its surroundings."""
    kind: ForceKind = ForceKind.FRAME
    limits: tuple[float, ...] = (0.1, 0.1, 0.1, 0.35, 0.35, 0.35)
    """Greatest speed of compliant axes (m/s, rad/s); the others do not deviate, so theirs count for nothing."""
    damping: float = 0.025
    """0 keeps speed, 1 loses it at once (force_mode_set_damping)."""
    gain_scaling: float = 1.0
    """0 to 2 (force_mode_set_gain_scaling)."""


def task_axes(task: ForceTask, tool_m: Array, tool_speed: Array) -> Array:
    """Return R of the task frame's axes in base axes, by the task's kind.  (3,), (3,) -> (3, 3)"""
    T = matrix_from_pose(task.frame)
    R = T[:3, :3]
    if task.kind is ForceKind.POINT:
        y = T[:3, 3] - tool_m
        return R if np.linalg.norm(y) < STILL else _basis(y, R[:, 2], is_y=True)
    if task.kind is ForceKind.MOTION:
        x = tool_speed - R[:, 2] * float(R[:, 2] @ tool_speed)
        return R if np.linalg.norm(x) < STILL else _basis(x, R[:, 2], is_y=False)
    return R


def _basis(main: Array, z_hint: Array, *, is_y: bool) -> Array:
    """Return axes whose y (or x) is main and whose z is as near to a hint as can be."""
    main = main / np.linalg.norm(main)
    z = z_hint - main * float(main @ z_hint)
    if np.linalg.norm(z) < STILL:
        z = np.eye(3)[int(np.argmin(np.abs(main)))]
        z = z - main * float(main @ z)
    z = z / np.linalg.norm(z)
    if is_y:
        return np.column_stack([np.cross(main, z), main, z])
    return np.column_stack([main, np.cross(z, main), z])


class ForceLaw:
    """Speed in proportion to the missing force, smoothed and limited. Holds its last speed, no more.

    Args:
        task: What was asked.
        dt_s: One slice.
        before: The law that this one takes over from: programs call force_mode again in every slice.
    """

    def __init__(self, task: ForceTask, *, dt_s: float, before: "ForceLaw | None" = None) -> None:
        self.task = task
        self._dt_s = dt_s
        self._share = 1.0 - math.exp(-dt_s / SMOOTHING_S)
        self._speed: Array = np.zeros(6) if before is None else before._speed
        self._free = np.array(task.is_compliant, dtype=bool)
        self._gain = np.array(SPEED_PER_FORCE) * task.gain_scaling
        self._wrench, self._limits = np.array(task.wrench), np.abs(task.limits)

    def twist(self, nominal: Array, felt: Sequence[float] | Array, tool_m: Array, *, is_ending: bool = False) -> Array:
        """Return the tool's speed in base axes: compliant along some axes, as the program has it along the others.

        Args:
            nominal: The program's own tool speed (v, w), base axes.  (6,)
            felt: Force and torque of the world on the tool, at the tool, base axes.  (6,)
            tool_m: Where the tool is.  (3,)
            is_ending: Come to rest along the compliant axes, whatever is felt.

        Returns:
            (v, w), base axes.  (6,)
        """
        R = task_axes(self.task, tool_m, nominal[:3])
        program, measured = _turned(R.T, nominal), _turned(R.T, np.asarray(felt))
        if is_ending:
            self._brake()
        else:
            wanted = self._gain * (self._wrench + measured)
            self._speed += self._share * (wanted - self._speed)
        self._speed = np.clip(self._speed, -self._limits, self._limits)
        self._speed[~self._free] = 0.0
        return _turned(R, np.where(self._free, self._speed * (1.0 - self.task.damping), program))

    def _brake(self) -> None:
        left_s = max(length(self._speed[:3]) / BRAKE[0], length(self._speed[3:]) / BRAKE[1])
        self._speed *= max(0.0, 1.0 - self._dt_s / left_s) if left_s else 0.0


def _turned(R: Array, pair: Array) -> Array:
    return np.concatenate([R @ pair[:3], R @ pair[3:]])
