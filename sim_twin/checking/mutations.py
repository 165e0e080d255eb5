"""Each limit weakened alone by 5 %: the stack is given the weaker one, the monitor keeps the true one and must tell.

A limit that something tighter hides (the arm's own file, another limit) would never be reached. So each is first made
the one that binds, for stack and monitor alike, and shown to hold like that; only then it is weakened for the stack.

Not among them, for no stream brings the physics within 5 % of them yet: the forces of contacts (motion backs off at a
small share of them), the grip's force (the cylinders lie under shut lids) and opening (the hand's own stroke), and time
and distance of a stop, which are the plant's to keep.
"""

from collections.abc import Callable, Iterator

import msgspec

from config.limits import ArmPart, Fence, KeepOut, Plane, Profile
from config.resolved import Resolved
from robot.teleop.battery import FAMILIES, Battery
from sim_twin.checking.check import FULL_STREAMS
from sim_twin.checking.ring import Ring
from sim_twin.perturb import NOMINAL

__all__ = ["BY", "MUTATIONS", "Mutation", "Outcome", "try_mutation"]

BY = 1.05
replace = msgspec.structs.replace


class Mutation(msgspec.Struct, frozen=True, kw_only=True):
    """One limit, how it is made to bind, how it is weakened, and the families of streams that go for it."""

    name: str
    told_by: tuple[str, ...]
    """Readings of which one must be broken."""
    tighten: Callable[[Profile], Profile]
    weaken: Callable[[Profile], Profile]
    families: tuple[str, ...]


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """What came of one mutation."""

    limit: str
    true_margin_share: float
    """The least margin with the stack as it is."""
    weakened_margin_share: float
    is_held: bool
    """Nothing was broken with the stack as it is."""
    is_caught: bool
    family: str = ""
    """Of the stream that told it."""
    number: int = -1


def _joints(profile: Profile, **by: float) -> Profile:
    joints = tuple(replace(j, **{key: getattr(j, key) * factor for key, factor in by.items()}) for j in profile.joints)
    return replace(profile, joints=joints)


def _set_joints(profile: Profile, **values: float) -> Profile:
    return replace(profile, joints=tuple(replace(j, **values) for j in profile.joints))


def _narrow(profile: Profile) -> Profile:
    """Leave each joint so much round the pose over the table that the workspace does not hide its range."""
    home, half = (2.8186, -1.7634, 2.014, -1.8213, -1.5708, -1.8938), (0.35, 0.35, 0.4, 0.4, 0.3, 0.6)
    joints = tuple(
        replace(j, range_rad=(q - h, q + h), soft_margin_rad=0.1)
        for j, q, h in zip(profile.joints, home, half, strict=True)
    )
    return replace(profile, joints=joints)


def _widen(profile: Profile) -> Profile:
    def wide(span: tuple[float, float]) -> tuple[float, float]:
        middle, half = (span[0] + span[1]) / 2.0, (span[1] - span[0]) / 2.0 * BY
        return middle - half, middle + half

    return replace(profile, joints=tuple(replace(j, range_rad=wide(j.range_rad)) for j in profile.joints))


def _speeds(profile: Profile, **values: float) -> Profile:
    return replace(profile, speeds=replace(profile.speeds, **values))


def _space(profile: Profile, **values: object) -> Profile:
    return replace(profile, workspace=replace(profile.workspace, **values))


def _fence(by: float) -> tuple[Fence, ...]:
    low, high = (0.27, -0.3, 0.04), (0.59, 0.3, 0.28)
    middle = [(a + b) / 2.0 for a, b in zip(low, high, strict=True)]
    half = [(b - a) / 2.0 * by for a, b in zip(low, high, strict=True)]
    low = (middle[0] - half[0], middle[1] - half[1], middle[2] - half[2])
    high = (middle[0] + half[0], middle[1] + half[1], middle[2] + half[2])
    return (Fence(name="inner", low_m=low, high_m=high),)


def _plane(by: float) -> tuple[Plane, ...]:
    return (Plane(name="far", point_m=(0.55 * by, 0.0, 0.0), normal=(-1.0, 0.0, 0.0), parts=(ArmPart.TCP,)),)


def _ball(by: float) -> tuple[KeepOut, ...]:
    centre = (0.42, 0.1, 0.11)
    return (KeepOut(name="ball", low_m=centre, high_m=centre, radius_m=0.08 / by),)


def _grip(profile: Profile, **values: tuple[float, float]) -> Profile:
    return replace(profile, grip=replace(profile.grip, **values))


def _clear(profile: Profile, **values: float) -> Profile:
    return replace(profile, clearances=replace(profile.clearances, **values))


_FAST = ("full_speed", "fast_joints", "steps", "random_joints", "gate_at_places", "gate_jumps")
_PLACES = ("at_the_box", "circles", "at_the_fences", "random_walk", "gate_at_places", "random_joints")
MUTATIONS: tuple[Mutation, ...] = (
    Mutation(
        name="joint range", told_by=("joint_range",), tighten=_narrow, weaken=_widen,
        families=("at_the_joints", "random_joints", "gate_at_places", "fast_joints"),
    ),
    Mutation(
        name="joint speed", told_by=("command_speed",),
        tighten=lambda p: _set_joints(p, speed_rad_s=0.4),
        weaken=lambda p: _joints(p, speed_rad_s=BY),
        families=("gate_at_places", *_FAST),
    ),
    Mutation(
        name="joint acceleration", told_by=("joint_acceleration", "command_acceleration"),
        tighten=lambda p: _set_joints(p, acceleration_rad_s2=3.0, stop_acceleration_rad_s2=4.0),
        weaken=lambda p: _joints(p, acceleration_rad_s2=BY),
        families=_FAST,
    ),
    Mutation(
        name="joint stop acceleration", told_by=("command_stop_acceleration",),
        tighten=lambda p: _set_joints(p, acceleration_rad_s2=3.0, stop_acceleration_rad_s2=3.0),
        weaken=lambda p: _joints(p, stop_acceleration_rad_s2=BY),
        families=_FAST,
    ),
    Mutation(
        name="joint jerk", told_by=("command_jerk",), tighten=lambda p: _set_joints(p, jerk_rad_s3=60.0),
        weaken=lambda p: _joints(p, jerk_rad_s3=BY), families=_FAST,
    ),
    Mutation(
        name="joint stop jerk", told_by=("command_stop_jerk",),
        tighten=lambda p: _set_joints(p, jerk_rad_s3=400.0, stop_jerk_rad_s3=400.0),
        weaken=lambda p: _joints(p, stop_jerk_rad_s3=BY), families=_FAST,
    ),
    Mutation(
        name="tcp speed", told_by=("tcp_speed", "command_tcp_speed"), tighten=lambda p: _speeds(p, tcp_m_s=0.2),
        weaken=lambda p: _speeds(p, tcp_m_s=0.2 * BY), families=_FAST,
    ),
    Mutation(
        name="flange speed", told_by=("flange_speed", "command_flange_speed"),
        tighten=lambda p: _speeds(p, flange_m_s=0.15),
        weaken=lambda p: _speeds(p, flange_m_s=0.15 * BY), families=_FAST,
    ),
    Mutation(
        name="elbow speed", told_by=("elbow_speed", "command_elbow_speed"),
        tighten=lambda p: _speeds(p, elbow_m_s=0.08),
        weaken=lambda p: _speeds(p, elbow_m_s=0.08 * BY), families=_FAST,
    ),
    Mutation(
        name="box", told_by=("box:inner",), tighten=lambda p: _space(p, boxes=_fence(1.0)),
        weaken=lambda p: _space(p, boxes=_fence(BY)), families=_PLACES,
    ),
    Mutation(
        name="plane", told_by=("plane:far",), tighten=lambda p: _space(p, planes=_plane(1.0)),
        weaken=lambda p: _space(p, planes=_plane(BY)), families=_PLACES,
    ),
    Mutation(
        name="keep-out", told_by=("keep_out:ball",), tighten=lambda p: _space(p, keep_outs=_ball(1.0)),
        weaken=lambda p: _space(p, keep_outs=_ball(BY)), families=("at_the_fences", *_PLACES),
    ),
    Mutation(
        name="tool cone", told_by=("tool_cone",), tighten=lambda p: _space(p, tool_cone_rad=0.4),
        weaken=lambda p: _space(p, tool_cone_rad=0.4 * BY), families=("tilts", "random_joints", "gate_at_places"),
    ),
    Mutation(
        name="grip speed", told_by=("grip_speed",), tighten=lambda p: _grip(p, speed_m_s=(0.02, 0.1)),
        weaken=lambda p: _grip(p, speed_m_s=(0.02, 0.1 * BY)), families=("gate_grips", "mixed"),
    ),
    Mutation(
        name="scene clearance", told_by=("scene_clearance",), tighten=lambda p: _clear(p, scene_m=0.03),
        weaken=lambda p: _clear(p, scene_m=0.03 / BY),
        families=("at_the_things", "at_the_box", "tilts", "random_joints", "gate_at_places"),
    ),
    Mutation(
        name="self clearance", told_by=("self_clearance",), tighten=lambda p: _clear(p, self_m=0.06),
        weaken=lambda p: _clear(p, self_m=0.06 / BY), families=("tilts", "random_joints", "gate_at_places"),
    ),
)  # fmt: skip


def try_mutation(
    resolved: Resolved, mutation: Mutation, *, seed: int, n_streams: int = 12, n_commands: int = 334
) -> Outcome:
    """Run the same streams with the limit as it is and weakened, until one tells.

    Args:
        resolved: rig and the profile to start from.
        mutation: which limit.
        seed: of the streams.
        n_streams: at most so many of them.
        n_commands: of each.
    """
    true = mutation.tighten(resolved.profile)
    sound, weak = (
        Ring(_holding(resolved, p), NOMINAL, true, n_commands=n_commands) for p in (true, mutation.weaken(true))
    )
    try:
        held = list(_runs(sound, mutation, seed, n_streams))
        least, is_held = min((m for m, *_ in held), default=1.0), not any(broken for _, broken, *_ in held)
        weakened, caught = 1.0, None
        for margin, broken, family, number in _runs(weak, mutation, seed, n_streams):
            weakened = min(weakened, margin)
            if broken:
                caught = (family, number)
                break
    finally:
        sound.close()
        weak.close()
    family, number = caught or ("", -1)
    return Outcome(
        limit=mutation.name, true_margin_share=least, weakened_margin_share=weakened, is_held=is_held,
        is_caught=is_held and caught is not None, family=family, number=number,
    )  # fmt: skip


def _runs(ring: Ring, mutation: Mutation, seed: int, n: int) -> Iterator[tuple[float, bool, str, int]]:
    battery = Battery(seed=seed, n_streams=FULL_STREAMS, n_plants=1)
    for number in range(n):
        family = mutation.families[number % len(mutation.families)]
        came = ring.run(
            lambda look, arena, f=family, k=number: FAMILIES[f](look, arena, battery.rng(k)),
            number=number, family=family, seed=seed + number,
        )  # fmt: skip
        told = [r for r in came.readings if r.limit in mutation.told_by]
        yield min((r.share for r in told), default=1.0), any(r.is_broken for r in told), family, number


def _holding(resolved: Resolved, profile: Profile) -> Resolved:
    """Return a config whose rig holds this profile."""
    profiles = tuple(profile if p.name == profile.name else p for p in resolved.limits.profiles)
    return replace(resolved, limits=replace(resolved.limits, profiles=profiles))
