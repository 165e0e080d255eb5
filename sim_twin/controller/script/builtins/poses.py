"""The pose functions of `sim_twin.controller.pose` under their URScript names."""

from sim_twin.controller import pose as poses
from sim_twin.controller.script.builtins.arguments import number, pose, vector
from sim_twin.controller.script.code import Builtins
from sim_twin.controller.script.values import Value

__all__ = ["POSES"]


def _pose_trans(p_from: Value, p_from_to: Value) -> Value:
    return poses.pose_trans(pose(p_from), pose(p_from_to))


def _pose_inv(p_from: Value) -> Value:
    return poses.pose_inv(pose(p_from))


def _pose_add(p_1: Value, p_2: Value) -> Value:
    return poses.pose_add(pose(p_1), pose(p_2))


def _pose_sub(p_to: Value, p_from: Value) -> Value:
    return poses.pose_sub(pose(p_to), pose(p_from))


def _pose_dist(p_from: Value, p_to: Value) -> Value:
    return poses.pose_dist(pose(p_from), pose(p_to))


def _point_dist(p_from: Value, p_to: Value) -> Value:
    return poses.point_dist(pose(p_from), pose(p_to))


def _interpolate_pose(p_from: Value, p_to: Value, alpha: Value) -> Value:
    return poses.interpolate_pose(pose(p_from), pose(p_to), number(alpha))


def _rotvec2rpy(rotation_vector: Value) -> Value:
    return list(poses.rpy_from_rotvec(vector(rotation_vector, 3)))


def _rpy2rotvec(rpy_vector: Value) -> Value:
    return list(poses.rotvec_from_rpy(vector(rpy_vector, 3)))


def _wrench_trans(T_from_to: Value, w_from: Value) -> Value:
    return list(poses.wrench_trans(pose(T_from_to), vector(w_from, 6)))


POSES: Builtins = {
    "interpolate_pose": _interpolate_pose,
    "point_dist": _point_dist,
    "pose_add": _pose_add,
    "pose_dist": _pose_dist,
    "pose_inv": _pose_inv,
    "pose_sub": _pose_sub,
    "pose_trans": _pose_trans,
    "rotvec2rpy": _rotvec2rpy,
    "rpy2rotvec": _rpy2rotvec,
    "wrench_trans": _wrench_trans,
}
