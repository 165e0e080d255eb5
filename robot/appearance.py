"""How the arm and its tool look: housings, caps and tubes after a UR5e's proportions. No physics."""

from collections.abc import Iterable

import mujoco
import numpy as np
from numpy.typing import NDArray

from config.arm import ArmConfig

__all__ = ["dress_arm", "dress_tool"]

Array = NDArray[np.float64]
GREY = (0.80, 0.81, 0.83, 1.0)
DARK = (0.25, 0.26, 0.28, 1.0)
BLUE = (0.42, 0.62, 0.80, 1.0)
STEEL = (0.62, 0.64, 0.67, 1.0)

# Round parts of each link in its DH frame: from, to, radius, colour.
Part = tuple[tuple[float, float, float], tuple[float, float, float], float, tuple[float, float, float, float]]
PARTS: dict[int, tuple[Part, ...]] = {
    0: (
        ((0, 0, 0), (0, 0, 0.018), 0.0755, STEEL),
        ((0, 0, 0.018), (0, 0, 0.092), 0.062, GREY),
    ),
    1: (
        ((0, -0.068, 0), (0, 0.058, 0), 0.060, GREY),
        ((0, 0.058, 0), (0, 0.068, 0), 0.057, BLUE),
        ((0, 0, 0), (0, 0, 0.070), 0.057, GREY),
        ((0, 0, -0.050), (0, 0, 0), 0.057, GREY),
        ((0, 0, -0.060), (0, 0, -0.050), 0.055, BLUE),
    ),
    2: (
        ((0.425, 0, 0.071), (0.425, 0, 0.190), 0.060, GREY),
        ((0.425, 0, 0.190), (0.425, 0, 0.200), 0.057, BLUE),
        ((0.425, 0, 0.138), (0.0, 0, 0.138), 0.044, GREY),
        ((0, 0, 0.078), (0, 0, 0.186), 0.050, GREY),
        ((0, 0, 0.186), (0, 0, 0.195), 0.047, BLUE),
    ),
    3: (
        ((0.3922, 0, -0.048), (0.3922, 0, 0.076), 0.048, GREY),
        ((0.3922, 0, -0.057), (0.3922, 0, -0.048), 0.045, BLUE),
        ((0.3922, 0, 0.007), (0.0, 0, 0.007), 0.037, GREY),
        ((0, 0, -0.040), (0, 0, 0.058), 0.040, GREY),
        ((0, 0, -0.049), (0, 0, -0.040), 0.038, BLUE),
    ),
    4: (
        ((0, -0.075, 0), (0, 0.046, 0), 0.039, GREY),
        ((0, 0.046, 0), (0, 0.055, 0), 0.037, BLUE),
        ((0, 0, 0), (0, 0, 0.054), 0.039, GREY),
    ),
    5: (
        ((0, -0.046, 0), (0, 0.045, 0), 0.039, GREY),
        ((0, -0.055, 0), (0, -0.046, 0), 0.037, BLUE),
        ((0, 0, 0), (0, 0, 0.052), 0.039, GREY),
    ),
    6: (((0, 0, -0.046), (0, 0, -0.010), 0.0375, STEEL), ((0, 0, -0.010), (0, 0, 0), 0.034, DARK)),
}


def dress_arm(body: mujoco.MjsBody, i: int, T: Array | None = None) -> None:
    """Add link i's visible parts; T carries its DH frame into the body's frame.  (4, 4)"""
    _add_parts(body, PARTS[i], np.eye(4) if T is None else T)


def dress_tool(body: mujoco.MjsBody, arm: ArmConfig) -> None:
    """Add the visible palm of a parallel-jaw gripper."""
    end = arm.tool.tcp_m[2] - arm.tool.finger_depth_m
    _add_parts(
        body, (((0, 0, 0), (0, 0, 0.014), 0.0375, STEEL), ((0, 0, 0.014), (0, 0, 0.022), 0.036, BLUE)), np.eye(4)
    )
    box = mujoco.mjtGeom.mjGEOM_BOX
    look = {"contype": 0, "conaffinity": 0, "group": 2, "mass": 0}
    waist = 0.5 * (0.022 + end)
    body.add_geom(
        type=box, size=[0.031, 0.036, (waist - 0.022) / 2], pos=[0, 0, (0.022 + waist) / 2], rgba=DARK, **look
    )
    body.add_geom(type=box, size=[0.029, 0.058, (end - waist) / 2], pos=[0, 0, (end + waist) / 2], rgba=DARK, **look)


def _add_parts(body: mujoco.MjsBody, parts: Iterable[Part], T: Array) -> None:
    for start, end, radius, rgba in parts:
        ends = [T[:3, :3] @ np.asarray(p, dtype=float) + T[:3, 3] for p in (start, end)]
        body.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CYLINDER, fromto=np.concatenate(ends), size=[radius, 0, 0], rgba=rgba,
            contype=0, conaffinity=0, group=2, mass=0,
        )  # fmt: skip
