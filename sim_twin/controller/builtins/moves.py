"""movej, movel, movep, movec, servoc, optimovej, optimovel."""

from collections.abc import Callable
from functools import wraps

import numpy as np

from sim_twin.controller.builtins.moving import in_slices
from sim_twin.controller.machine import Machine
from sim_twin.controller.motion import Motion
from sim_twin.controller.motion.poses import Array, pose_from_matrix
from sim_twin.controller.pose import Pose
from sim_twin.controller.script import Builtins, Value
from sim_twin.controller.script.builtins import integer, number, vector

__all__ = ["move_builtins"]

OPTIMAL_M_S2 = 10.0
"""optimovel at an acceleration of 1; UR's own follows the joints' torques."""


def move_builtins(machine: Machine) -> Builtins:
    """Return the moves along a path."""
    core, moves = machine.drive.core, machine.drive.motions.moves
    joints = machine.world.arm.joints
    v_max = min(j.speed_rad_s for j in joints)
    a_max = min(j.acceleration_rad_s2 for j in joints)

    def aim(target: Value) -> tuple[list[float], bool]:
        goal, is_pose = vector(target, 6), type(target) is Pose
        machine.waypoint = np.array(goal) if is_pose else pose_from_matrix(core.tool_at(np.array(goal)))
        return goal, is_pose

    def movej(q: Value, a: Value = 1.4, v: Value = 1.05, t: Value = 0, r: Value = 0) -> Motion:
        goal, is_pose = aim(q)
        return moves.movej(goal, number(a), number(v), number(t), number(r), is_pose=is_pose)

    def movel(pose: Value, a: Value = 1.2, v: Value = 0.25, t: Value = 0, r: Value = 0) -> Motion:
        goal, is_pose = aim(pose)
        return moves.movel(goal, number(a), number(v), number(t), number(r), is_pose=is_pose)

    def movep(pose: Value, a: Value = 1.2, v: Value = 0.25, r: Value = 0) -> Motion:
        goal, is_pose = aim(pose)
        return moves.movep(goal, number(a), number(v), number(r), is_pose=is_pose)

    def movec(
        pose_via: Value, pose_to: Value, a: Value = 1.2, v: Value = 0.25, r: Value = 0, mode: Value = 0
    ) -> Motion:
        via, _ = as_pose(pose_via)
        to, machine.waypoint = as_pose(pose_to)
        return moves.movec(via, to, number(a), number(v), number(r), integer(mode))

    def as_pose(target: Value) -> tuple[Array, Array]:
        goal = np.array(vector(target, 6))
        pose = goal if type(target) is Pose else pose_from_matrix(core.tool_at(goal))
        return pose, pose

    def servoc(pose: Value, a: Value = 1.2, v: Value = 0.25, r: Value = 0) -> Motion:
        goal, is_pose = aim(pose)
        machine.waypoint = None
        return moves.servoc(goal, number(a), number(v), number(r), is_pose=is_pose)

    def optimovej(q: Value, a: Value = 0.3, v: Value = 0.3, r: Value = 0) -> Motion:
        goal, is_pose = aim(q)
        fastest, hardest = _share(v) * v_max, _share(a) * a_max
        return moves.movej(goal, hardest, fastest, 0.0, number(r), is_pose=is_pose)

    def optimovel(pose: Value, a: Value = 0.3, v: Value = 0.3, r: Value = 0) -> Motion:
        goal, is_pose = aim(pose)
        fastest = _share(v) * machine.drive.limits.tool_speed_m_s
        return moves.movel(goal, _share(a) * OPTIMAL_M_S2, fastest, 0.0, number(r), is_pose=is_pose)

    return {name: in_slices(_counted(machine, move)) for name, move in {
        "movej": movej, "movel": movel, "movep": movep, "movec": movec, "servoc": servoc,
        "optimovej": optimovej, "optimovel": optimovel,
    }.items()}  # fmt: skip


def _counted(machine: Machine, begin: Callable[..., Motion]) -> Callable[..., Motion]:
    """Return a move that counts among those under way for as long as a program is in it."""

    @wraps(begin)
    def move(*positional: Value, **keywords: Value) -> Motion:
        motion = begin(*positional, **keywords)
        machine.n_moves += 1
        try:
            yield from motion
        finally:
            machine.n_moves -= 1

    return move


def _share(value: Value) -> float:
    share = number(value)
    if not 0.0 < share <= 1.0:
        raise ValueError(f"expected a share above 0 and up to 1, got {share:g}")
    return share
