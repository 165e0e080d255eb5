"""Intents shape a target point for the tool: bounded steps, guarded speed, fences. Pure; the arm trails the target.

Every function takes where the target is and returns where it goes, and names what shortened or changed it.
"""

import math

import msgspec

from config.arm import ArmConfig
from robot.geometry import inside_box
from robot.messages import Box3, Heading, Twist, Vec3

__all__ = ["Shaped", "TargetLimits", "advance_heading", "advance_twist", "fence", "guard", "is_free"]

MAX_TURN_RAD = 0.2
"""Greatest turn of the tool in one step."""
TABLE_MARGIN_M = 0.001
_TINY = 1e-9


class TargetLimits(msgspec.Struct, frozen=True, kw_only=True):
    """What bounds the target, base frame, from the arm's file and the table's height."""

    max_step_m: float
    leash_m: float
    guard_z_m: float
    guarded_speed_m_s: float
    heights_m: tuple[float, float]
    table_m: float
    tip_min_m: float
    """Lowest that a fingertip is brought."""
    workspace_m: Box3
    """The configured box, its floor raised to where the fingertips are clear of the table."""

    @classmethod
    def of(cls, arm: ArmConfig, table_m: float) -> "TargetLimits":
        """Return the limits of an arm over a table of this height."""
        motion = arm.motion
        low, high = motion.workspace_m
        tip_min_m = table_m + motion.table_clearance_m + TABLE_MARGIN_M
        floor = max(low[2], tip_min_m + arm.tool.tip_below_tcp_m)
        return cls(
            max_step_m=motion.max_step_m,
            leash_m=motion.leash_m,
            guard_z_m=table_m + motion.guard_height_m,
            guarded_speed_m_s=motion.guarded_speed_m_s,
            heights_m=motion.heights_m,
            table_m=table_m,
            tip_min_m=tip_min_m,
            workspace_m=((low[0], low[1], floor), high),
        )


class Shaped(msgspec.Struct, frozen=True):
    """A new target point and what had a hand in it."""

    position_m: Vec3
    limiters: tuple[str, ...] = ()
    amount_m: float = 0.0
    """How much longer the way would have been that was asked for, or how far away the height."""


def advance_heading(at_m: Vec3, intent: Heading, limits: TargetLimits, duration_s: float) -> Shaped:
    """Move the target along a direction in the plane and towards a height over the table.

    Neither part exceeds the longest step, nor does their sum: a far height and a full step go up or down at 45 degrees.
    """
    names: list[str] = []
    distance = intent.distance_m
    asked = math.hypot(distance, limits.table_m + intent.height_m - at_m[2])
    longest = limits.max_step_m
    if distance > longest + _TINY:
        distance = longest
        names.append("max_step")
    height = min(max(intent.height_m, limits.heights_m[0]), limits.heights_m[1])
    if abs(height - intent.height_m) > _TINY:
        names.append("height")
    rise = limits.table_m + height - at_m[2]
    rise = min(max(rise, -longest), longest)
    length = math.hypot(distance, rise)
    if length > longest:
        distance *= longest / length
        rise *= longest / length
    step = (distance * math.cos(intent.heading_rad), distance * math.sin(intent.heading_rad), rise)
    return _move(at_m, step, limits, duration_s, names, asked)


def advance_twist(at_m: Vec3, intent: Twist, limits: TargetLimits, duration_s: float) -> Shaped:
    """Move the target by a velocity times the step's length, at most the longest step."""
    names: list[str] = []
    x, y, z = (v * duration_s for v in intent.linear_m_s)
    length = math.hypot(x, y, z)
    if length > limits.max_step_m + _TINY:
        scale = limits.max_step_m / length
        x, y, z = x * scale, y * scale, z * scale
        names.append("max_step")
    if intent.angular_rad_s[0] or intent.angular_rad_s[1]:
        names.append("tool_down")
    return _move(at_m, (x, y, z), limits, duration_s, names, length)


def guard(at_m: Vec3, step_m: Vec3, limits: TargetLimits, duration_s: float) -> tuple[Vec3, bool]:
    """Slow a step near the table: below the guard height the target sinks and slides at guarded speed; it rises freely.

    The two together: a finger that came down aslant on a lid's edge at either of them met it with 281 N.

    Returns:
        The step and whether it was slowed.
    """
    x, y, z = step_m
    above = max(at_m[2] - limits.guard_z_m, 0.0)
    if at_m[2] + z >= limits.guard_z_m - _TINY:
        return step_m, False
    slow, sink = limits.guarded_speed_m_s * duration_s, max(0.0, -z - above)
    length = math.hypot(x, y, sink)
    if length <= slow + _TINY:
        return step_m, False
    share = slow / length
    return (x * share, y * share, z if sink == 0.0 else -(above + share * sink)), True


def fence(target_m: Vec3, tool_m: Vec3, limits: TargetLimits) -> Shaped:
    """Keep the target inside the workspace and within the leash of the tool.

    Args:
        target_m: where the target would go, base frame.
        tool_m: what the leash is held at: where a free tool is by now, or the measured tool where it has strayed from
            that (mover.STRAY_M).
        limits: workspace and leash.
    """
    names: list[str] = []
    (x0, y0, z0), (x1, y1, z1) = limits.workspace_m
    x, y, z = target_m
    inside = (min(max(x, x0), x1), min(max(y, y0), y1), min(max(z, z0), z1))
    if inside != target_m:
        names.append("workspace")
    away = math.dist(inside, tool_m)
    if away > limits.leash_m:
        share = limits.leash_m / away
        x, y, z = inside
        mx, my, mz = tool_m
        inside = (mx + (x - mx) * share, my + (y - my) * share, mz + (z - mz) * share)
        names.append("leash")
    return Shaped(inside, tuple(names))


def is_free(target_m: Vec3, tool_m: Vec3, limits: TargetLimits, *, stray_m: float) -> bool:
    """Return whether the fence leaves a target alone wherever the leash is held.

    Args:
        target_m: where the target would go, base frame.
        tool_m: the measured tool.
        limits: workspace and leash.
        stray_m: how far from there the leash may be held.
    """
    is_near = math.dist(target_m, tool_m) <= limits.leash_m - stray_m - _TINY
    return is_near and inside_box(target_m, *limits.workspace_m)


def _move(
    at_m: Vec3, step_m: Vec3, limits: TargetLimits, duration_s: float, names: list[str], asked_m: float
) -> Shaped:
    (x, y, z), is_slowed = guard(at_m, step_m, limits, duration_s)
    if is_slowed:
        names.append("guard")
    amount_m = max(0.0, asked_m - math.hypot(x, y, z)) if names else 0.0
    return Shaped((at_m[0] + x, at_m[1] + y, at_m[2] + z), tuple(names), amount_m)
