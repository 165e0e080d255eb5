"""The arm's own shapes and what stands on its table as one MuJoCo model without physics: what distances are taken on.

Links are the file's capsules, the hand is a box for the palm and one for the fingers, wide open. The table is the
half-space under its top. What stands on it is solid (robot.safety.blocks): links and palm have no business inside of
it, and fingers, which have, are held off leaves alone that stand or move. Where things stand may change (`put`).
"""

import itertools
import math
from collections.abc import Iterator
from enum import StrEnum
from functools import lru_cache

import msgspec
import mujoco
import numpy as np
from numpy.typing import NDArray

from config.arm import ArmConfig
from robot.description import dh_constant
from robot.safety.blocks import Block

__all__ = ["BALLS", "THING_PREFIX", "Hard", "Near", "Pair", "collision_model", "put"]

Array = NDArray[np.float64]
THING_PREFIX = "thing/"
FINGERS, PALM = "fingers", "palm"
BALLS = {PALM: "palm_ball", FINGERS: "fingers_ball"}
"""The collision pass finds no distance between boxes that are apart: a ball finds whom a box is to be asked of."""
ANGLES_TRIED = 36
NEVER_NEARER_M = 0.002
"""Parts two links apart that no joint angles bring nearer than this cannot touch, however thick their capsules."""
PALM_HALF_M = (0.032, 0.06)
"""Half extents of the palm across and along the jaws, as the arm's description has it."""
KEPT = 16
"""Arms at tables whose untouchable parts are remembered."""
OWN_LINKS_APART = 2
"""Links with fewer joints between them are neighbours and always touch."""
_BOX, _CAPSULE, _PLANE = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CAPSULE, mujoco.mjtGeom.mjGEOM_PLANE


class Near(StrEnum):
    """What a part of the arm is near to."""

    OWN = "own"
    TABLE = "table"
    THING = "thing"
    LEAF = "leaf"
    """A lid's leaf that stands or moves, seen from the fingers."""


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
    leaf_m: float = 0.0

    def farther(self, by_m: float) -> "Hard":
        """Return distances that are all greater by as much."""
        return Hard(**{name: value + by_m for name, value in msgspec.structs.asdict(self).items()})

    def of(self, near: Near) -> float:
        """Return the distance kept from one kind of thing."""
        return getattr(self, f"{near}_m")


def collision_model(
    arm: ArmConfig, *, table_m: float, blocks: tuple[Block, ...], hard: Hard, reach_m: float
) -> tuple[mujoco.MjModel, tuple[Pair, ...]]:
    """Return the model and the pairs that MuJoCo's collision pass looks at, in its order.

    A contact of the pass carries the distance that its pair keeps as `includemargin`.

    Args:
        arm: the arm's file.
        table_m: height of the table's top, base frame.
        blocks: what stands on it, in the order in which `put` takes it later.
        hard: the distances kept.
        reach_m: distances beyond this are not looked at.
    """
    spec = _spec(arm, table_m, blocks)
    apart = _remembered(arm, table_m)
    pairs = [pair for pair in _pairs(arm, blocks) if pair not in apart]
    for pair in pairs:
        kept = hard.of(pair.near)
        spec.add_pair(geomname1=_shape(pair), geomname2=pair.other, margin=kept, gap=reach_m - kept, condim=1)
    model = spec.compile()
    named = {(_shape(pair), pair.other): pair for pair in pairs}
    ends = zip(model.pair_geom1.tolist(), model.pair_geom2.tolist(), strict=True)
    names = [(model.geom(a).name, model.geom(b).name) for a, b in ends]
    return model, tuple(named.get((a, b)) or named[(b, a)] for a, b in names)


def put(model: mujoco.MjModel, geom: int, block: Block) -> None:
    """Give a thing's shape another place and size, in a compiled model."""
    model.geom_sameframe[geom] = 0  # else its turn is taken for its body's
    model.geom_pos[geom], model.geom_quat[geom] = block.centre_m, block.quat
    model.geom_size[geom] = model.geom_aabb[geom, 3:] = block.half_m
    model.geom_rbound[geom] = math.hypot(*block.half_m)


def _pairs(arm: ArmConfig, blocks: tuple[Block, ...]) -> Iterator[Pair]:
    """Name every pair that counts: own parts that are no neighbours, links and palm against the world."""
    parts = _parts(arm)
    for i, (a, link_a) in enumerate(parts):
        for b, link_b in parts[i + 1 :]:
            if abs(link_b - link_a) >= OWN_LINKS_APART:
                yield Pair(a, b, Near.OWN)
    for name in [name for name, link in parts if link > 0 and name != FINGERS]:
        yield Pair(name, "table", Near.TABLE)
        for block in [block for block in blocks if not block.is_for_fingers]:
            yield Pair(name, THING_PREFIX + block.name, Near.THING)
    for block in [block for block in blocks if block.is_for_fingers]:
        yield Pair(FINGERS, THING_PREFIX + block.name, Near.LEAF)


def _shape(pair: Pair) -> str:
    """Return the shape of the arm's that the collision pass asks for a pair."""
    return BALLS.get(pair.part, pair.part) if pair.near in (Near.THING, Near.LEAF) else pair.part


def _parts(arm: ArmConfig) -> list[tuple[str, int]]:
    """Return the arm's parts and the link that each moves with, base to hand."""
    return [*((f"link_{c.link}_{k}", c.link) for k, c in enumerate(arm.capsules)), (PALM, 6), (FINGERS, 6)]


def _never_touching(arm: ArmConfig, table_m: float) -> frozenset[Pair]:
    """Return the pairs of the arm with itself and the table that no joint angles bring near: tried once, in 20 ms."""
    model = _spec(arm, table_m, ()).compile()
    return frozenset(pair for pair in _pairs(arm, ()) if not _can_touch(arm, model, pair))


_remembered = lru_cache(maxsize=KEPT)(_never_touching)
"""No decorator: mutants are made of functions without one (docs/mutation.md)."""


def _can_touch(arm: ArmConfig, model: mujoco.MjModel, pair: Pair) -> bool:
    """Whether two shapes come near at any joint angles at all; asked where two joints at most are between them."""
    links = dict(_parts(arm))
    first, last = sorted((links[pair.part], links.get(pair.other, 0)))
    if last - first > OWN_LINKS_APART:
        return True
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
        world.add_geom(
            name=THING_PREFIX + block.name, type=_BOX, size=block.half_m, pos=block.centre_m, quat=block.quat
        )  # fmt: skip
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
    _add_ball(hand, PALM, half, palm_end / 2)
    half = [tool.pad_size_m[1] / 2, reach, (tip_end - palm_end) / 2]
    hand.add_geom(name=FINGERS, type=_BOX, size=half, pos=[0, 0, (palm_end + tip_end) / 2])
    _add_ball(hand, FINGERS, half, (palm_end + tip_end) / 2)


def _add_ball(hand: mujoco.MjsBody, part: str, half_m: list[float], out_m: float) -> None:
    size = [float(np.linalg.norm(half_m)), 0, 0]
    hand.add_geom(name=BALLS[part], type=mujoco.mjtGeom.mjGEOM_SPHERE, size=size, pos=[0, 0, out_m])


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
