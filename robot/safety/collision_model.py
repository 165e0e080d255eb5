"""The arm's own shapes and what stands on its table as one MuJoCo model without physics: what distances are taken on.

Links are the file's capsules, the hand is a box for the palm and one for the fingers, wide open. The table is the
half-space under its top. Boxes, buttons and standing cylinders are solid, over the whole region that the scenario
may draw them from: links and palm have no business inside of them, and fingers, which have, are not held off things.
"""

import itertools
from collections.abc import Iterator
from enum import StrEnum

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from config.arm import ArmConfig
from config.scenario import Scenario
from robot.description import dh_constant

__all__ = ["PALM", "PALM_BALL", "THING_PREFIX", "Block", "Hard", "Near", "Pair", "blocks_of", "collision_model"]

Array = NDArray[np.float64]
THING_PREFIX = "thing/"
FINGERS, PALM, PALM_BALL = "fingers", "palm", "palm_ball"
ANGLES_TRIED = 36
NEVER_NEARER_M = 0.002
"""Parts two links apart that no joint angles bring nearer than this cannot touch, however thick their capsules."""
PALM_HALF_M = (0.032, 0.06)
"""Half extents of the palm across and along the jaws, as the arm's description has it."""
OWN_LINKS_APART = 2
"""Links with fewer joints between them are neighbours and always touch."""
_BOX, _CAPSULE, _PLANE = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_PLANE


class Near(StrEnum):
    """What a part of the arm is near to."""

    OWN = "own"
    TABLE = "table"
    THING = "thing"


class Block(msgspec.Struct, frozen=True, kw_only=True):
    """An upright box that links and palm keep out of, base frame, metres."""

    name: str
    centre_m: tuple[float, float, float]
    half_m: tuple[float, float, float]


class Pair(msgspec.Struct, frozen=True):
    """Two shapes whose distance counts, by name; the first is the arm's."""

    part: str
    other: str
    near: Near


class Hard(msgspec.Struct, frozen=True, kw_only=True):
    """Distances that links and palm keep at the least, metres."""

    own_m: float = 0.01
    table_m: float = 0.005
    thing_m: float = 0.005

    def of(self, near: Near) -> float:
        """Return the distance kept from one kind of thing."""
        return {Near.OWN: self.own_m, Near.TABLE: self.table_m, Near.THING: self.thing_m}[near]


def blocks_of(scenario: Scenario) -> tuple[Block, ...]:
    """Return what stands on a table, each as wide as the region it is drawn from."""
    z0 = scenario.table.height_m
    centres = {box.name: (box.position_m, box.spread_m) for box in scenario.boxes}
    made = [
        _block(b.name, b.position_m, b.spread_m, (b.diameter_m, b.diameter_m), z0, b.height_m) for b in scenario.buttons
    ]
    for box in scenario.boxes:
        outer = (box.inner_m[0] + 2.0 * box.wall_m, box.inner_m[1] + 2.0 * box.wall_m)
        made.append(_block(box.name, box.position_m, box.spread_m, outer, z0, box.height_m))
    for thing in scenario.cylinders:
        (x, y), (sx, sy) = centres.get(thing.inside or "", ((0.0, 0.0), (0.0, 0.0)))
        at = (x + thing.position_m[0], y + thing.position_m[1])
        spread = (sx + thing.spread_m[0], sy + thing.spread_m[1])
        made.append(_block(thing.name, at, spread, (thing.diameter_m, thing.diameter_m), z0, thing.height_m))
    return tuple(made)


def _block(
    name: str, at: tuple[float, float], spread: tuple[float, float], size: tuple[float, float], z0: float, height: float
) -> Block:
    half = (size[0] / 2.0 + spread[0], size[1] / 2.0 + spread[1], height / 2.0)
    return Block(name=name, centre_m=(at[0], at[1], z0 + height / 2.0), half_m=half)


def collision_model(
    arm: ArmConfig, *, table_m: float, blocks: tuple[Block, ...], hard: Hard, reach_m: float
) -> tuple[mujoco.MjModel, tuple[Pair, ...]]:
    """Return the model and the pairs that MuJoCo's collision pass looks at, in its order.

    A contact of the pass carries the distance that its pair keeps as `includemargin`.

    Args:
        arm: the arm's file.
        table_m: height of the table's top, base frame.
        blocks: what stands on it.
        hard: the distances kept.
        reach_m: distances beyond this are not looked at.
    """
    spec = _spec(arm, table_m, blocks)
    pairs = [pair for pair in _pairs(arm, blocks) if _can_touch(arm, spec, pair)]
    for pair in pairs:
        other = PALM_BALL if pair.part == PALM and pair.near is Near.THING else pair.part
        kept = hard.of(pair.near)
        spec.add_pair(geomname1=other, geomname2=pair.other, margin=kept, gap=reach_m - kept, condim=1)
    model = spec.compile()
    named = {(PALM_BALL if p.part == PALM and p.near is Near.THING else p.part, p.other): p for p in pairs}
    ends = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)
    names = [(model.geom(a).name, model.geom(b).name) for a, b in ends]
    return model, tuple(named.get((a, b)) or named[(b, a)] for a, b in names)


def _pairs(arm: ArmConfig, blocks: tuple[Block, ...]) -> Iterator[Pair]:
    """Name every pair that counts: own parts that are no neighbours, links and palm against the world."""
    parts = _parts(arm)
    for i, (a, link_a) in enumerate(parts):
        for b, link_b in parts[i + 1 :]:
            if abs(link_b - link_a) >= OWN_LINKS_APART:
                yield Pair(a, b, Near.OWN)
    for name in [name for name, link in parts if link > 0 and name != FINGERS]:
        yield Pair(name, "table", Near.TABLE)
        for block in blocks:
            yield Pair(name, THING_PREFIX + block.name, Near.THING)


def _parts(arm: ArmConfig) -> list[tuple[str, int]]:
    """Return the arm's parts and the link that each moves with, base to hand."""
    return [*((f"link_{c.link}_{k}", c.link) for k, c in enumerate(arm.capsules)), (PALM, 6), (FINGERS, 6)]


def _can_touch(arm: ArmConfig, spec: mujoco.MjSpec, pair: Pair) -> bool:
    """Whether two shapes come near at any joint angles at all; asked where two joints at most are between them."""
    links = dict(_parts(arm))
    first, last = sorted((links[pair.part], links.get(pair.other, 0)))
    if last - first > OWN_LINKS_APART:
        return True
    model = spec.compile()
    data = mujoco.MjData(model)
    a, b = model.geom(pair.part).id, model.geom(pair.other).id
    angles = np.linspace(-np.pi, np.pi, ANGLES_TRIED, endpoint=False)
    for q in itertools.product(angles, repeat=last - first):
        data.qpos[first:last] = q
        mujoco.mj_kinematics(model, data)
        if mujoco.mj_geomDistance(model, data, a, b, 1.0, None) < NEVER_NEARER_M:
            return True
    return False


def _spec(arm: ArmConfig, table_m: float, blocks: tuple[Block, ...]) -> mujoco.MjSpec:
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    _add_arm(spec, arm)
    world = spec.worldbody
    world.add_geom(name="table", type=_PLANE, size=[2, 2, 0.1], pos=[0, 0, table_m])
    for block in blocks:
        world.add_geom(name=THING_PREFIX + block.name, type=_BOX, size=block.half_m, pos=block.centre_m)
    for geom in spec.geoms:
        geom.contype = geom.conaffinity = 0
    return spec


def _add_arm(spec: mujoco.MjSpec, arm: ArmConfig) -> None:
    body, T = spec.worldbody, np.eye(4)
    _add_capsules(body, arm, 0, T)
    for i, joint in enumerate(arm.joints, start=1):
        body = body.add_body(
            name=f"link_{i}", pos=T[:3, 3], quat=_quat(T), mass=1.0, inertia=[1, 1, 1], explicitinertial=True
        )
        T = dh_constant(joint)
        body.add_joint(name=joint.name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1])
        _add_capsules(body, arm, i, T)
    tool = arm.tool
    hand = body.add_body(name="tool", pos=T[:3, 3], quat=_quat(T))
    hand.add_site(name="tcp", pos=tool.tcp_m)
    palm_end = tool.tcp_m[2] - tool.finger_depth_m
    tip_end = tool.tcp_m[2] + tool.tip_below_tcp_m
    reach = tool.stroke_m / 2.0 + tool.pad_size_m[0]
    half = [*PALM_HALF_M, palm_end / 2]
    hand.add_geom(name=PALM, type=_BOX, size=half, pos=[0, 0, palm_end / 2])
    # The collision pass finds no distance between boxes that are apart: a ball finds whom the palm is to be asked of.
    ball = [float(np.linalg.norm(half)), 0, 0]
    hand.add_geom(name=PALM_BALL, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=ball, pos=[0, 0, palm_end / 2])
    hand.add_geom(
        name=FINGERS, type=_BOX, size=[tool.pad_size_m[1] / 2, reach, (tip_end - palm_end) / 2],
        pos=[0, 0, (palm_end + tip_end) / 2],
    )  # fmt: skip


def _add_capsules(body: mujoco.MjsBody, arm: ArmConfig, link: int, T: Array) -> None:
    for k, capsule in enumerate(arm.capsules):
        if capsule.link == link:
            ends = [T[:3, :3] @ np.asarray(p) + T[:3, 3] for p in (capsule.from_m, capsule.to_m)]
            body.add_geom(
                name=f"link_{link}_{k}", type=_CAPSULE, fromto=np.concatenate(ends), size=[capsule.radius_m, 0, 0]
            )


def _quat(T: Array) -> Array:
    quat = np.zeros(4)
    mujoco.mju_mat2Quat(quat, T[:3, :3].ravel().copy())
    return quat
