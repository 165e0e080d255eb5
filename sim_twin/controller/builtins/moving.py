"""Motions as builtins: one slice at each yield."""

from collections.abc import Callable, Generator
from functools import wraps

from sim_twin.controller.motion import Motion, MotionConflictError
from sim_twin.controller.motion.poses import Array
from sim_twin.controller.pose import Pose
from sim_twin.controller.script import Builtin, ScriptRuntimeError, Value

__all__ = ["as_list", "as_pose", "in_slices"]


def in_slices(begin: Callable[..., Motion]) -> Builtin:
    """Return a builtin that follows a motion to its end; two at once end the program, as on a robot.

    Args:
        begin: Takes the call's arguments and returns the motion.
    """

    @wraps(begin)
    def follow(*positional: Value, **keywords: Value) -> Generator[None, None, Value]:
        try:
            yield from begin(*positional, **keywords)
        except MotionConflictError as error:
            raise ScriptRuntimeError(f"another thread is already controlling the robot: {error}") from error

    return follow


def as_pose(array: Array) -> Pose:
    """Return six numbers as a pose.  (6,) -> Pose"""
    return Pose(*array.tolist())


def as_list(array: Array) -> list[Value]:
    """Return an array as a list, a matrix as a list of rows."""
    return array.tolist()
