"""What must hold between the values of a limits file, and between it, the arm, the rig and the scenario."""

import math

from config.arm import ArmConfig
from config.checks import Checker
from config.limits import ATTENDED, ATTENDED_SPEED_M_S, LimitsFile, Plane, Profile
from config.yaml_text import join

__all__ = ["check_limits", "check_limits_fit", "check_profile_named"]

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


def check_limits_fit(limits: LimitsFile, arm: ArmConfig, file: str) -> None:
    """Check that a limits file is for this arm and its tool."""
    checker = Checker(file)
    checker.need(limits.arm == arm.name, "arm", f"{arm.name}, the arm that the rig names", limits.arm)
    checker.need(limits.tool == arm.tool.name, "tool", f"{arm.tool.name}, the arm's tool", limits.tool)


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
