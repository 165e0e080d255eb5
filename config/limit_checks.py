"""What must hold between the values of a limits file, and between it, the arm, the rig and the scenario."""

import math

from config.arm import ArmConfig
from config.checks import Checker
from config.limited import FENCE_MARGIN_M
from config.limits import ATTENDED, ATTENDED_SPEED_M_S, ArmPart, Fence, KeepOut, LimitsFile, Plane, Profile
from config.posture import part_points, tilt_rad
from config.scenario import Scenario
from config.values import Point
from config.yaml_text import join

__all__ = ["check_limits", "check_limits_fit", "check_parked", "check_profile_named"]

Joints = tuple[float, float, float, float, float, float]
ROUNDING_M = 1e-9
PUSH_N_S_M = 1000.0
"""What presses on a tool that slides into what stands on the table, for each m/s at which it met that: on the twin 580
at most, fingers empty or full, on rings, boxes and lids, on a plant that lags twice as much too."""
TAKEN = "reduced"
"""A name of UR's own, for a mode of the controller's safety system."""


def check_limits(limits: LimitsFile, file: str) -> None:
    """Check the profiles of a limits file, each by itself."""
    checker = Checker(file)
    checker.unique(((f"profiles[{i}].name", profile.name) for i, profile in enumerate(limits.profiles)), "a name")
    for i, profile in enumerate(limits.profiles):
        _check_profile(profile, f"profiles[{i}]", checker)


def check_profile_named(limits: LimitsFile, name: str, rig_file: str) -> None:
    """Check that a rig names a profile that there is."""
    Checker(rig_file).known(name, (profile.name for profile in limits.profiles), "profile", f"one of {limits.name}'s")


def check_limits_fit(limits: LimitsFile, arm: ArmConfig, scenario: Scenario, file: str) -> None:
    """Check that a limits file is for this arm and its tool, and that each profile leaves the arm a home and room.

    Args:
        limits: the file.
        arm: the arm, its workspace cut to the scenario's.
        scenario: the table.
        file: what errors call the limits file.
    """
    checker = Checker(file)
    checker.need(limits.arm == arm.name, "arm", f"{arm.name}, the arm that the rig names", limits.arm)
    checker.need(limits.tool == arm.tool.name, "tool", f"{arm.tool.name}, the arm's tool", limits.tool)

    for i, profile in enumerate(limits.profiles):
        where = f"profiles[{i}]"
        _check_home(profile, arm, where, checker)
        _check_room(profile, arm, scenario, where, checker)
        _check_grip(profile, arm, where, checker)
        _check_stopping(profile, arm, where, checker)
        _check_contacts(profile, arm, where, checker)
        _check_guarded(profile, arm, where, checker)


def check_parked(profile: Profile, arm: ArmConfig, parked_rad: Joints, file: str) -> None:
    """Check that where the arm waits for a person is inside of every range, fence and cone, and of its workspace.

    Args:
        profile: the limits that are held.
        arm: the arm, its workspace cut to the scenario's.
        parked_rad: its joints there.
        file: what errors call the rig's file.
    """
    checker, at = Checker(file), "parked_rad"
    for i, (joint, angle_rad) in enumerate(zip(profile.joints, parked_rad, strict=True)):
        low, high = (end + sign * joint.soft_margin_rad for end, sign in zip(joint.range_rad, (1, -1), strict=True))
        checker.need(low <= angle_rad <= high, f"{at}[{i}]", f"an angle from {low:g} to {high:g}", f"{angle_rad:g}")
    points, space = part_points(arm, parked_rad), profile.workspace
    low_m, high_m = arm.motion.workspace_m
    x, y, z = tcp = points[ArmPart.TCP]
    is_in = all(a <= v <= b for a, v, b in zip(low_m, tcp, high_m, strict=True))
    checker.need(is_in, at, f"a tool from {low_m} to {high_m} m", f"one at ({x:.3f}, {y:.3f}, {z:.3f}) m")
    for thing in (*space.boxes, *space.planes, *space.keep_outs):
        for part in thing.parts:
            expected = f"{thing.name} to leave the {part} on the allowed side"
            checker.need(gap_m(thing, points[part]) > 0.0, at, expected, "it beyond")
    tilt = tilt_rad(arm, parked_rad)
    checker.need(tilt < space.tool_cone_rad, at, f"a tool tilted by less than {space.tool_cone_rad:g}", f"{tilt:g}")


def _check_home(profile: Profile, arm: ArmConfig, where: str, checker: Checker) -> None:
    """Check that the arm's home is inside of every range, fence and cone."""
    for i, (joint, home_rad) in enumerate(zip(profile.joints, arm.home_rad, strict=True)):
        low, high = joint.range_rad
        expected = f"a range with the arm's home_rad[{i}] {home_rad:g} in it, soft_margin_rad inside of its ends"
        is_in = low + joint.soft_margin_rad <= home_rad <= high - joint.soft_margin_rad
        checker.need(is_in, f"{where}.joints[{i}].range_rad", expected, f"{low:g} to {high:g}")
    points, space, at = part_points(arm, arm.home_rad), profile.workspace, f"{where}.workspace"
    for group in ("boxes", "planes", "keep_outs"):
        for i, thing in enumerate(getattr(space, group)):
            for part in thing.parts:
                x, y, z = points[part]
                expected = (
                    f"{thing.name} to leave the {part} at home, ({x:.3f}, {y:.3f}, {z:.3f}) m, on the allowed side"
                )
                checker.need(gap_m(thing, points[part]) > 0.0, f"{at}.{group}[{i}]", expected, "it beyond")
    tilt = tilt_rad(arm, arm.home_rad)
    expected = f"more than {tilt:g}, the tool's tilt at home"
    checker.need(space.tool_cone_rad > tilt, f"{at}.tool_cone_rad", expected, f"{space.tool_cone_rad:g}")


def _check_room(profile: Profile, arm: ArmConfig, scenario: Scenario, where: str, checker: Checker) -> None:
    """Check that boxes leave the tool all of a workspace that the scenario names, and its heights over the table."""
    lowest, travel = (scenario.table.height_m + height for height in arm.motion.heights_m)
    low, high = list(arm.motion.workspace_m[0]), list(arm.motion.workspace_m[1])
    what = "the scenario's workspace_m"
    if scenario.workspace_m is None:
        what = "the home and the heights that the tool comes to"
        home = part_points(arm, arm.home_rad)[ArmPart.TCP]
        low, high = [home[0], home[1], lowest], [home[0], home[1], travel]
    for i, box in enumerate(profile.workspace.boxes):
        if ArmPart.TCP not in box.parts:
            continue
        at, m = f"{where}.workspace.boxes[{i}]", FENCE_MARGIN_M
        for axis in range(3):
            least, most = f"at most {low[axis] - m:g}, for {what}", f"at least {high[axis] + m:g}, for {what}"
            is_low, is_high = (
                box.low_m[axis] <= low[axis] - m + ROUNDING_M,
                box.high_m[axis] >= high[axis] + m - ROUNDING_M,
            )
            checker.need(is_low, f"{at}.low_m[{axis}]", least, f"{box.low_m[axis]:g}")
            checker.need(is_high, f"{at}.high_m[{axis}]", most, f"{box.high_m[axis]:g}")


def _check_grip(profile: Profile, arm: ArmConfig, where: str, checker: Checker) -> None:
    """Check that what the hand is asked while working is allowed."""
    tool, grip = arm.tool, profile.grip
    asked = (
        ("opening_m", (0.0, tool.stroke_m), "0 to the tool's stroke_m"),
        ("force_n", (tool.grip_force_n, tool.grip_force_n), "a range with the tool's grip_force_n in it"),
    )
    for key, (least, most), what in asked:
        low, high = getattr(grip, key)
        is_in = low <= least and most <= high
        checker.need(is_in, f"{where}.grip.{key}", f"{what}, {least:g} to {most:g}", f"{low:g} to {high:g}")
    low, high = max(tool.speed_m_s[0], grip.speed_m_s[0]), min(tool.speed_m_s[1], grip.speed_m_s[1])
    expected = f"a range that meets the tool's {tool.speed_m_s[0]:g} to {tool.speed_m_s[1]:g}"
    got = f"{grip.speed_m_s[0]:g} to {grip.speed_m_s[1]:g}"
    checker.need(low < high, f"{where}.grip.speed_m_s", expected, got)


def _check_stopping(profile: Profile, arm: ArmConfig, where: str, checker: Checker) -> None:
    """Check that motion as it is tuned comes to rest within what is allowed, the servo's look-ahead included."""
    motion = arm.motion
    speed = min(motion.speed_m_s, profile.speeds.tcp_m_s)
    time_s = speed / motion.acceleration_m_s2 + motion.acceleration_m_s2 / motion.jerk_m_s3
    distance_m = speed * time_s / 2.0 + speed * arm.servo.lookahead_s
    time_s += arm.servo.lookahead_s
    for key, needed in (("distance_m", distance_m), ("time_s", time_s)):
        allowed = getattr(profile.stopping, key)
        expected = f"at least {needed:.3f}, what motion takes from {speed:g} m/s, or a slower speeds.tcp_m_s"
        checker.need(allowed >= needed, f"{where}.stopping.{key}", expected, f"{allowed:g}")


def _check_contacts(profile: Profile, arm: ArmConfig, where: str, checker: Checker) -> None:
    """Check that no pair promises more than the tool's own limits hold, for nothing else holds a pair."""
    blow_n, speed = min(profile.contact_force.blow_n, arm.motion.impact_limit_n), profile.speeds.tcp_m_s
    for i, pair in enumerate(profile.contacts):
        at, what = f"{where}.contacts[{i}]", "that hold every pair; lower those"
        hard, fast = f"at least {blow_n:g}, the newtons of a blow", f"at least {speed:g}, the tool's m/s"
        checker.need(pair.force_n >= blow_n, f"{at}.force_n", f"{hard} {what}", f"{pair.force_n:g}")
        checker.need(pair.speed_m_s >= speed, f"{at}.speed_m_s", f"{fast} {what}", f"{pair.speed_m_s:g}")


def _check_guarded(profile: Profile, arm: ArmConfig, where: str, checker: Checker) -> None:
    """Check that what a tool meets low over the table, at guarded speed, presses on it no harder than may last."""
    met_m_s = min(arm.motion.guarded_speed_m_s, profile.speeds.tcp_m_s)
    what = f"what may press on a tool that meets things at {met_m_s:g} m/s, or a slower motion.guarded_speed_m_s"
    steady_n, needed = profile.contact_force.steady_n, PUSH_N_S_M * met_m_s
    at = f"{where}.contact_force.steady_n"
    checker.need(steady_n >= needed * (1.0 - 1e-9), at, f"at least {needed:g}, {what}", f"{steady_n:g}")


def gap_m(fence: Fence | Plane | KeepOut, point_m: Point) -> float:
    """Return how far a point is on the allowed side of a fence, negative beyond."""
    if isinstance(fence, Plane):
        away = zip(point_m, fence.point_m, fence.normal, strict=True)
        return sum((p - q) * n for p, q, n in away) / math.hypot(*fence.normal)
    sides = list(zip(fence.low_m, point_m, fence.high_m, strict=True))
    inside = min(min(p - low, high - p) for low, p, high in sides)
    if isinstance(fence, Fence):
        return inside
    outside = math.hypot(*(max(low - p, 0.0, p - high) for low, p, high in sides))
    return (outside if outside > 0.0 else -inside) - fence.radius_m


def _check_profile(profile: Profile, where: str, checker: Checker) -> None:
    checker.need(
        profile.name != TAKEN, join(where, "name"), f"another name than the controller's own {TAKEN}", profile.name
    )
    if profile.name == ATTENDED:
        for key in ("tcp_m_s", "elbow_m_s", "flange_m_s"):
            speed = getattr(profile.speeds, key)
            most = f"at most {ATTENDED_SPEED_M_S:g} in the profile {ATTENDED}"
            checker.need(speed <= ATTENDED_SPEED_M_S, f"{where}.speeds.{key}", most, f"{speed:g}")
    _check_joints(profile, where, checker)
    _check_workspace(profile, where, checker)
    force = profile.contact_force
    at_least = f"at least steady_n = {force.steady_n:g}"
    checker.need(force.steady_n <= force.blow_n, f"{where}.contact_force.blow_n", at_least, f"{force.blow_n:g}")
    for key in ("opening_m", "force_n", "speed_m_s"):
        checker.ascending(getattr(profile.grip, key), f"{where}.grip.{key}")
    pairs = ((f"{where}.contacts[{i}]", (pair.part, pair.thing)) for i, pair in enumerate(profile.contacts))
    checker.unique(pairs, "a pair")


def _check_joints(profile: Profile, where: str, checker: Checker) -> None:
    for i, joint in enumerate(profile.joints):
        low, high = joint.range_rad
        checker.ascending(joint.range_rad, f"{where}.joints[{i}].range_rad")
        half = (high - low) / 2
        checker.need(
            joint.soft_margin_rad < half,
            f"{where}.joints[{i}].soft_margin_rad",
            f"less than {half:g}, half the joint's range",
            f"{joint.soft_margin_rad:g}",
        )
        for own, stop in (("acceleration_rad_s2", "stop_acceleration_rad_s2"), ("jerk_rad_s3", "stop_jerk_rad_s3")):
            least, most = getattr(joint, own), getattr(joint, stop)
            checker.need(least <= most, f"{where}.joints[{i}].{stop}", f"at least {own} = {least:g}", f"{most:g}")


def _check_workspace(profile: Profile, where: str, checker: Checker) -> None:
    space = profile.workspace
    groups = {"boxes": space.boxes, "planes": space.planes, "keep_outs": space.keep_outs}
    names = [
        (f"{where}.workspace.{group}[{i}]", thing) for group, things in groups.items() for i, thing in enumerate(things)
    ]
    checker.unique(((f"{place}.name", thing.name) for place, thing in names), "a name")
    for place, thing in names:
        checker.unique(((f"{place}.parts[{i}]", part) for i, part in enumerate(thing.parts)), "a part")
        if isinstance(thing, Plane):
            checker.need(math.hypot(*thing.normal) > 1e-3, f"{place}.normal", "a direction", "one of no length")
    for i, box in enumerate(space.boxes):
        for axis in range(3):
            checker.ascending((box.low_m[axis], box.high_m[axis]), f"{where}.workspace.boxes[{i}].high_m[{axis}]")
    for i, box in enumerate(space.keep_outs):
        at = f"{where}.workspace.keep_outs[{i}]"
        for axis, (low, high) in enumerate(zip(box.low_m, box.high_m, strict=True)):
            checker.need(low <= high, f"{at}.high_m[{axis}]", f"at least low_m's {low:g}", f"{high:g}")
        is_solid = box.radius_m > 0.0 or all(low < high for low, high in zip(box.low_m, box.high_m, strict=True))
        checker.need(is_solid, f"{at}.radius_m", "above 0, for a box without extent", f"{box.radius_m:g}")
