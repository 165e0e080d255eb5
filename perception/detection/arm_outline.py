"""The arm's own silhouette: its file's capsules and its hand's blocks, where the joints say they are. Pure maths."""

import numpy as np

from config.arm import ArmConfig
from perception.calibration.lens import Array
from perception.detection.eye import Eye
from perception.detection.shapes import hull
from robot.description import dh_constant
from robot.messages import Vec6

__all__ = ["arm_outlines", "arm_parts"]

MARGIN_M = 0.010
"""Housings bulge out of the capsules that collisions are reckoned with."""
N_ROUND = 12
FINGER_M = (0.015, 0.022)
"""Half width of a finger across the jaws, and its depth along them."""
PALM_HALF_M = 0.036
NEAREST_M = 0.10
"""What is nearer to the camera's plane than this has no outline."""


def arm_outlines(arm: ArmConfig, q_rad: Vec6, opening_m: float, eye: Eye) -> list[Array]:
    """Return convex polygons of pixels that the arm and its hand are behind or on.  each (n, 2)"""
    T_cb = np.linalg.inv(eye.T_bc)
    outlines = []
    for points in arm_parts(arm, q_rad, opening_m):
        if (points @ T_cb[2, :3] + T_cb[2, 3] > NEAREST_M).all():
            pixels = eye.pixels(points)
            pixels = pixels[np.isfinite(pixels).all(axis=1)]
            if len(pixels):
                outlines.append(hull(pixels))
    return outlines


def arm_parts(arm: ArmConfig, q_rad: Vec6, opening_m: float) -> list[Array]:
    """Return points whose hulls hold the links, the palm and the fingers, base frame.  each (n, 3) m"""
    frames = [np.eye(4)]
    for joint, q in zip(arm.joints, q_rad, strict=True):
        c, s = np.cos(q), np.sin(q)
        R_z = np.array([[c, -s, 0.0, 0.0], [s, c, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
        frames.append(frames[-1] @ R_z @ dh_constant(joint))
    parts = []
    for capsule in arm.capsules:
        T = frames[capsule.link]
        radius = capsule.radius_m + MARGIN_M
        ends = (_ball(capsule.from_m, radius), _ball(capsule.to_m, radius))
        parts.append(np.concatenate(ends) @ T[:3, :3].T + T[:3, 3])
    flange = frames[-1]
    return parts + [block @ flange[:3, :3].T + flange[:3, 3] for block in _hand(arm, opening_m)]


def _hand(arm: ArmConfig, opening_m: float) -> list[Array]:
    """Return the corners of palm and fingers in the flange's frame."""
    tool = arm.tool
    palm_end, tip = tool.tcp_m[2] - tool.finger_depth_m, tool.tcp_m[2] + tool.tip_below_tcp_m
    half_width, depth = FINGER_M
    reach = tool.stroke_m / 2.0 + depth
    blocks = [_block((-PALM_HALF_M, -reach, 0.0), (PALM_HALF_M, reach, palm_end))]
    for sign in (-1.0, 1.0):
        inner, outer = sign * opening_m / 2.0, sign * (opening_m / 2.0 + depth)
        blocks.append(_block((-half_width, min(inner, outer), palm_end), (half_width, max(inner, outer), tip)))
    return blocks


def _block(low: tuple[float, float, float], high: tuple[float, float, float]) -> Array:
    return np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def _ball(centre: tuple[float, float, float], radius: float) -> Array:
    """Return points about a centre whose hull holds the ball but for a few hundredths of its radius."""
    return np.array(centre) + radius * ROUND


def _unit_ball() -> Array:
    turn = np.linspace(0.0, 2.0 * np.pi, N_ROUND, endpoint=False)
    rings = [
        np.column_stack([np.cos(lift) * np.cos(turn), np.cos(lift) * np.sin(turn), np.full(N_ROUND, np.sin(lift))])
        for lift in np.linspace(-np.pi / 2, np.pi / 2, 7)
    ]
    return np.concatenate(rings)


ROUND = _unit_ball()
