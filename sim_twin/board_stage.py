"""A table with printed sheets on it and nothing else: what a simulated camera is calibrated on."""

from collections.abc import Sequence

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

__all__ = ["Sheet", "board_stage"]

THICK_M = 0.0005


class Sheet(msgspec.Struct, frozen=True, kw_only=True):
    """A printed sheet: its picture, its size and where it is."""

    picture: NDArray[np.uint8]
    """(height, width) grey."""
    size_m: tuple[float, float]
    """Width and height on paper."""
    T_bs: NDArray[np.float64]
    """The sheet's upper left corner, x along its rows, y down its columns, z into the paper.  (4, 4)"""


def board_stage(
    sheets: Sequence[Sheet], *, table_rgb: tuple[float, float, float] = (0.62, 0.60, 0.57)
) -> mujoco.MjModel:
    """Return a world of a plain table top under even light with sheets where they are asked for."""
    spec = mujoco.MjSpec()
    spec.visual.quality.shadowsize = 0
    spec.visual.quality.offsamples = 0
    spec.visual.headlight.ambient = [0.75, 0.75, 0.75]
    spec.visual.headlight.diffuse = [0.2, 0.2, 0.2]
    spec.visual.headlight.specular = [0.0, 0.0, 0.0]
    spec.visual.map.znear = 0.02
    top = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[1.5, 1.5, 0.02], pos=[0.4, 0.0, -0.022])
    top.rgba = [*table_rgb, 1.0]
    for number, sheet in enumerate(sheets):
        _add_sheet(spec, sheet, f"sheet_{number}")
    return spec.compile()


def _add_sheet(spec: mujoco.MjSpec, sheet: Sheet, name: str) -> None:
    height, width = sheet.picture.shape
    colours = np.repeat(sheet.picture[..., None], 3, axis=2)
    texture = spec.add_texture(name=name, type=mujoco.mjtTexture.mjTEXTURE_2D, width=width, height=height, nchannel=3)
    texture.data = colours.tobytes()
    material = spec.add_material(name=name, emission=0.0, specular=0.0, reflectance=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = name
    mesh = spec.add_mesh(name=name)
    w, h = sheet.size_m
    mesh.uservert = [0, 0, 0, w, 0, 0, w, h, 0, 0, h, 0, 0, 0, THICK_M, w, 0, THICK_M, w, h, THICK_M, 0, h, THICK_M]
    mesh.userface = [
        0,
        2,
        1,
        0,
        3,
        2,
        4,
        5,
        6,
        4,
        6,
        7,
        0,
        1,
        5,
        0,
        5,
        4,
        1,
        2,
        6,
        1,
        6,
        5,
        2,
        3,
        7,
        2,
        7,
        6,
        3,
        0,
        4,
        3,
        4,
        7,
    ]
    mesh.usertexcoord = [0, 0, 1, 0, 1, 1, 0, 1, 0, 0, 1, 0, 1, 1, 0, 1]
    body = spec.worldbody.add_body(name=name, pos=sheet.T_bs[:3, 3])
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, sheet.T_bs[:3, :3].ravel())
    body.quat = quat
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, material=name, contype=0, conaffinity=0)
