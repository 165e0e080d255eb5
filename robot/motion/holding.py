"""Which limits a step of motion would meet too fast to stop inside, and how far it may go instead. Pure.

Only what goes towards a limit is held back, continuously: what goes away from it keeps its full speed. A step is
brought back towards the one of an arm that brakes, so that joints keep their accelerations and jerks (pacing), and
braking is begun so early that it suffices. Each limit says its name and by how much it held back, as a share of it.
"""

import math
from collections.abc import Sequence

import msgspec

from robot.compiled import Table, compiled
from robot.envelope import Envelope, braking_step, soft_step
from robot.fences import fence_away, fence_gap, row_of
from robot.messages import Vec3, Vec6
from robot.safety import Braking

__all__ = [
    "MARGIN_M",
    "OVERRUN_M",
    "PART",
    "PART_NAMES",
    "REST",
    "SPEED_RESERVE",
    "TIP",
    "TIPS",
    "Met",
    "Place",
    "Points",
    "brake_share",
    "braked_step",
    "led_out",
    "share_at_rest",
    "share_left",
    "share_of_giving_way",
    "share_of_way",
    "share_of_way_back",
    "slid",
    "slid_to",
    "speed_step",
    "stops_outside",
    "stretch",
    "tips_too_fast",
    "too_fast",
]

MARGIN_M = 5e-4
"""Motion stops this far inside of a fence, so that the gate never meets one by rounding or by a path that bows."""
SLIDE_MARGIN_M = 1e-3
"""The tool slides along a fence at this distance, so that inverse kinematics' last digits never bring it to a stop."""
OVERRUN_M = 2e-3
"""So far may the end of a stop at the worst be beyond a fence that the tool slides along: its joints' ways bend."""
TIPS = -1
"""Number of the fence that is the table under the fingertips."""
MARGIN_RAD = 1e-3
RESERVE = 0.95
"""Share of a limit that motion uses, so that the gate's own is never met by rounding."""
SPEED_RESERVE = 0.99
JOINT_RESERVE = 0.96
BRAKE_SHARE = 0.9
"""Of what joints can brake by, so much is counted on ahead of a limit: the rest makes up for ways that bend."""
BRAKING = Braking()
NEAR_SPEED = 0.8
"""From this share of a part's speed on it matters how fast it grows."""
TILT_RAD_S2 = 5.0
"""Deceleration of the tool's tilt that is counted on ahead of its cone."""
PART_NAMES = ("tcp_speed", "flange_speed", "elbow_speed")
JOINT, PART, FENCE, CONE, TIP, REST = range(6)

Points = tuple[Vec3, Vec3, Vec3]
Place = tuple[Points, float]
"""Points and the cosine of the tilt, as chain.ToolChain.points returns them."""


class Met(msgspec.Struct, frozen=True):
    """A limit that a step would go at too fast."""

    name: str
    kind: int
    index: int
    """Which joint, part or fence."""
    size: float
    """How far the step goes towards it: metres, or radians, of a joint as its step is signed."""
    most: float
    """How far it may."""


def braked_step(envelope: Envelope) -> float:
    """Return how much of the fastest joint's step is counted on to be braked off in a tick, rad.

    It is no more than what the arm's own stop takes off at the worst: the gate looks at where that would end.
    """
    own = BRAKE_SHARE * min([end.stop_rad for end in envelope.joints])
    return min(own, BRAKING.least_rad_s2 * envelope.tick_s * envelope.tick_s)


def brake_share(fastest: float, envelope: Envelope) -> float:
    """Return the share of every step that is counted on to be braked off in a tick, the fastest joint's so long."""
    return braked_step(envelope) / fastest


def stretch(lost: float, envelope: Envelope) -> float:
    """Return how many steps an arm goes that takes one, begins to brake, and loses that share of it in every tick."""
    return 1.0 + envelope.onset + 0.5 / lost


def too_fast(
    now_rad: Vec6,
    steps: Sequence[float],
    places: tuple[Points, Place, Place],
    end: Points | None,
    lost: float,
    envelope: Envelope,
) -> list[Met]:
    """Return the limits that a step would go at too fast; none, nearly always.

    Args:
        now_rad: the last command.
        steps: how far each joint would go.
        places: points at the command before the last; points and tilt at the last and where the step leads.
        end: points where joints that brake together would come to rest; None where the tool goes straight and slides
            along its fences.
        lost: share of every step that braking takes off in a tick.
        envelope: the limits.
    """
    before, now, to = places
    met = _of_joints(now_rad, steps, lost, envelope)
    met += _of_speeds(before, now[0], to[0], envelope)
    met += _of_fences(now[0], to[0], end, lost, envelope)
    return met + _of_cone(now[1], to[1], lost, envelope)


def share_of_way(met: Met, steps: Sequence[float], now: Place, base: Place, envelope: Envelope) -> float:
    """Return how much of the way from a braking arm's step to the one that was wanted a limit leaves, 0 to 1.

    Args:
        met: the limit.
        steps: the braking arm's.
        now: points and tilt at the last command.
        base: those where the braking arm's step leads.
        envelope: the limits.
    """
    i = met.index
    if met.kind == JOINT:
        size = steps[i] if met.size > 0.0 else -steps[i]
    elif met.kind == PART:
        size = math.dist(now[0][i], base[0][i])
    elif met.kind == FENCE:
        fence = envelope.fences[i]
        size = fence.gap(now[0][fence.part]) - fence.gap(base[0][fence.part])
    else:
        size = _angle(base[1]) - _angle(now[1])
    return share_left(met, size)


def stops_outside(end: Place, lowest_m: float, tip_min_m: float, least_m: float, envelope: Envelope) -> list[Met]:
    """Return the fences, and the table, outside of which a stop at the worst would end.

    Args:
        end: points there.
        lowest_m: how high the lowest fingertip is there.
        tip_min_m: how high it must stay.
        least_m: least gap that is inside.
        envelope: the fences.
    """
    met = [
        Met(fence.name, REST, i, 0.0, 0.0)
        for i, fence in enumerate(envelope.fences)
        if not fence.gap(end[0][fence.part]) >= least_m
    ]
    return met if lowest_m - tip_min_m >= least_m else [*met, Met("table", REST, TIPS, 0.0, 0.0)]


def share_at_rest(wanted_m: float, base_m: float) -> float:
    """Return how much of the way leaves the end of a stop inside of a fence, 0 to 1.

    An arm that took a step in between would stop in between or nearer to a braking arm's end, for what a stop takes
    grows faster than the speed.

    Args:
        wanted_m: gap where a stop from the step that was wanted ends, less the least that is inside.
        base_m: gap where one from the braking arm's step ends, likewise.
    """
    if wanted_m >= 0.0:
        return 1.0
    return base_m / (base_m - wanted_m) if base_m > 0.0 else 0.0


def share_left(met: Met, size: float) -> float:
    """Return how much of the way from a braking arm's step, so long towards a limit, to the wanted one is left."""
    wanted = abs(met.size)
    return min(1.0, (met.most - size) / (wanted - size)) if size < met.most else 0.0


def tips_too_fast(heights_m: Vec3, least_m: float, lost: float, envelope: Envelope) -> list[Met]:
    """Return the table, if fingertips would go down at it too fast.

    Args:
        heights_m: theirs at the last command, where the step leads, and where joints that brake together come to rest.
        least_m: how high they must stay.
        lost: share of every step that braking takes off in a tick.
        envelope: the limits.
    """
    now_m, to_m, end_m = heights_m
    size = max(now_m - to_m, (now_m - end_m) / stretch(lost, envelope))
    if size <= 0.0:
        return []
    most = braking_step(now_m - least_m - MARGIN_M, min(envelope.fence_braking_m, lost * size), envelope.onset)
    return [Met("table", TIP, 0, size, most)] if size > most else []


def share_of_giving_way(now_rad: Vec6, last_rad: Vec6, q_rad: Vec6, measured_rad: Vec6, envelope: Envelope) -> float:
    """Return how much of a step that gives way to a push may be taken by the joints' accelerations, above 0 to 1.

    Braking, and coming nearer to where the arm is measured, cost nothing.
    """
    share = 1.0
    for now, last, q, at, end in zip(now_rad, last_rad, q_rad, measured_rad, envelope.joints, strict=True):
        step, before, back = q - now, now - last, at - now
        if step < 0.0:
            step, before, back = -step, -before, -back
        most = RESERVE * end.gain_rad + max(0.0, before, back)
        if step > most:
            share = min(share, most / step)
    return share


def share_of_way_back(now_rad: Vec6, back_rad: Vec6, envelope: Envelope) -> float:
    """Return how much of the way to joints may be gone in a tick by an arm that is to rest there, above 0 to 1."""
    share = 1.0
    for now, back, end in zip(now_rad, back_rad, envelope.joints, strict=True):
        gap = abs(back - now)
        if gap > 0.0:
            share = min(share, braking_step(gap, RESERVE * RESERVE * end.gain_rad, envelope.onset) / gap)
    return share


def _of_joints(now_rad: Vec6, steps: Sequence[float], lost: float, envelope: Envelope) -> list[Met]:
    met: list[Met] = []
    for i, (now, step, end) in enumerate(zip(now_rad, steps, envelope.joints, strict=True)):
        size = abs(step)
        most = JOINT_RESERVE * end.step_rad
        if size > most:
            met.append(Met("joint_speed", JOINT, i, step, most))
        gap = end.high_rad - now if step > 0.0 else now - end.low_rad
        most = braking_step(gap, min(RESERVE * RESERVE * end.gain_rad, lost * size), envelope.onset)
        if gap - size < end.margin_rad:
            most = min(most, RESERVE * soft_step(gap, end.margin_rad, end.step_rad))
        if size > most:
            met.append(Met("soft_margin", JOINT, i, step, most))
    return met


def _of_speeds(before: Points, now: Points, to: Points, envelope: Envelope) -> list[Met]:
    met: list[Met] = []
    for i, most in enumerate(envelope.part_step_m):
        (x, y, z), (u, v, w) = now[i], to[i]
        dx, dy, dz = u - x, v - y, w - z
        squared = dx * dx + dy * dy + dz * dz
        bound = SPEED_RESERVE * most
        if squared > NEAR_SPEED * NEAR_SPEED * bound * bound:
            size = math.sqrt(squared)
            if envelope.overshoot > 0.0:
                bound = speed_step(bound, math.dist(before[i], now[i]), envelope.overshoot)
            if size > bound:
                met.append(Met(PART_NAMES[i], PART, i, size, bound))
    return met


def speed_step(most_m: float, last_m: float, overshoot: float) -> float:
    """Return how far a part may go that went so far in the tick before: what gathers speed, overshoots.

    It goes on gathering speed while its jerk ends that, by a share of what it gained: s + overshoot (s - last) may be
    `most_m` at most, for the step s itself that is taken and not for the one that was wanted. A wanted step that was
    long enough left nothing otherwise, and an arm at rest stayed there for good.
    """
    return most_m if last_m >= most_m else (most_m + overshoot * last_m) / (1.0 + overshoot)


def _of_fences(now: Points, to: Points, end: Points | None, lost: float, envelope: Envelope) -> list[Met]:
    met: list[Met] = []
    for i, fence in enumerate(envelope.fences):
        part = fence.part
        left = fence.gap(to[part])
        if left > envelope.fence_far_m:
            continue
        gap = fence.gap(now[part])
        size, braking = gap - left, envelope.fence_braking_m
        if end is not None:
            size = max(size, (gap - fence.gap(end[part])) / stretch(lost, envelope))
        if size <= 0.0:
            continue
        if part or end is not None:
            braking = min(braking, lost * size)
        most = braking_step(gap - MARGIN_M, braking, envelope.onset)
        if size > most:
            met.append(Met(fence.name, FENCE, i, size, most))
    return met


def _of_cone(down_now: float, down_to: float, lost: float, envelope: Envelope) -> list[Met]:
    if down_to >= envelope.cone_near_cosine or down_to >= down_now:
        return []
    tilt, left = _angle(down_now), _angle(down_to)
    size = left - tilt
    braking = min(TILT_RAD_S2 * envelope.tick_s * envelope.tick_s, lost * size)
    most = braking_step(envelope.cone_rad - MARGIN_RAD - tilt, braking, envelope.onset)
    return [Met("tool_cone", CONE, 0, size, most)] if size > most else []


@compiled
def _led_out(target_m: Vec3, fences: Table) -> tuple[Vec3, int]:
    last = -1
    for k in range(fences.shape[0]):
        row = row_of(fences, k)
        gap = fence_gap(row, target_m) - MARGIN_M if fences[k, 0] == 0.0 else 0.0
        if gap < 0.0:
            nx, ny, nz = fence_away(row, target_m)
            target_m = (target_m[0] - gap * nx, target_m[1] - gap * ny, target_m[2] - gap * nz)
            last = k
    return target_m, last


def led_out(target_m: Vec3, envelope: Envelope) -> tuple[Vec3, str]:
    """Return the nearest place that fences leave to the tool, and the name of what moved it last, empty for none."""
    place_m, last = _led_out(target_m, envelope.fence_rows)
    return place_m, envelope.fences[last].name if last >= 0 else ""


@compiled
def slid_to(now_m: Vec3, to_m: Vec3, fences: Table, law: Vec3) -> tuple[Vec3, int]:
    """Return what `slid` does, by number, -1 where none changed it; the law is Envelope's far, braking and onset."""
    far_m, braking_m, onset = law
    last = -1
    for k in range(fences.shape[0]):
        row = row_of(fences, k)
        left = fence_gap(row, to_m)
        if fences[k, 0] != 0.0 or left > far_m:
            continue
        gap = fence_gap(row, now_m)
        over = gap - left - braking_step(gap - SLIDE_MARGIN_M, braking_m, onset)
        if over > 0.0 and left < gap:
            nx, ny, nz = fence_away(row, now_m)
            to_m = (to_m[0] + over * nx, to_m[1] + over * ny, to_m[2] + over * nz)
            last = k
    return to_m, last


def slid(now_m: Vec3, to_m: Vec3, envelope: Envelope) -> tuple[Vec3, str]:
    """Return where the tool centre point goes instead, along the fences that it would come too near too fast.

    Only the part of the step that goes towards a fence is taken away, so that the tool slides along it and around it.

    Args:
        now_m: where it is.
        to_m: where it would go in this tick.
        envelope: the fences.

    Returns:
        The place, and the name of the last fence that changed it, empty where none did.
    """
    law = (envelope.fence_far_m, envelope.fence_braking_m, envelope.onset)
    place_m, last = slid_to(now_m, to_m, envelope.fence_rows, law)
    return place_m, envelope.fences[last].name if last >= 0 else ""


def _angle(cosine: float) -> float:
    return math.acos(max(-1.0, min(1.0, cosine)))
