"""What the gate holds, from the arm's file and what the arm says of itself. Pure values."""

import msgspec

from config.arm import ArmConfig
from config.limits import Profile
from robot.errors import RobotConfigError
from robot.messages import ArmSpec, Box3, Vec6

__all__ = ["GateLimits", "check_profile_fits"]

BOW_M = 0.01
"""Headings move the tool straight; towards joint targets it bows out, by up to 6 mm on a leash of 9 cm."""
FLOOR_BOW_M = 0.005
"""Near the table motion is guarded and bows less."""
SPEED_TOLERANCE = 1e-9
AGREED = 1e-3
"""File and arm round their limits differently."""


class GateLimits(msgspec.Struct, frozen=True, kw_only=True):
    """Limits of one arm over one table, base frame, per joint base to wrist 3. A value at its limit is allowed."""

    q_min_rad: Vec6
    q_max_rad: Vec6
    joint_step_rad: Vec6
    """Greatest change of a joint's command in one tick."""
    workspace_m: Box3
    """Where the commanded tool centre point may be."""
    tip_min_m: float
    """Lowest that a fingertip may be commanded, base frame."""
    tracking_error_rad: float
    contact_n: float
    """A tool with no more than this on it is free: its commands have nothing to give way to."""
    hard_n: float
    """Up to this a command gives way as hard as its joints may, and no harder."""
    force_max_n: float
    """Greatest steady force on the tool."""
    impact_max_n: float
    """Greatest force on the tool in a single tick."""
    opening_m: tuple[float, float]
    grip_force_n: tuple[float, float]
    grip_speed_m_s: tuple[float, float]
    output_mask: int
    """Bits of the outputs that the arm has."""
    state_max_age_ns: int
    percept_max_age_ns: int
    """Age of a percept at which what was begun with it must have come to rest."""
    intent_max_age_ns: int
    """Age of an intent at which commands must have come to rest: its deadline and the time to the end of the leash."""

    @classmethod
    def of(cls, arm: ArmConfig, spec: ArmSpec, *, table_m: float, tick_s: float) -> "GateLimits":
        """Return the limits that both the arm's file and the arm itself allow.

        Raises:
            RobotConfigError: the file and the arm are not of the same model, or leave a joint no range.
        """
        if spec.model != arm.name:
            raise RobotConfigError(f"the rig's arm file is for {arm.name!r}, the plant says {spec.model!r}")
        motion, tool = arm.motion, arm.tool
        low = tuple(max(j.range_rad[0], q) for j, q in zip(arm.joints, spec.q_min_rad, strict=True))
        high = tuple(min(j.range_rad[1], q) for j, q in zip(arm.joints, spec.q_max_rad, strict=True))
        for joint, a, b in zip(arm.joints, low, high, strict=True):
            if a >= b:
                raise RobotConfigError(f"joint {joint.name}: file and arm leave no range ({a} .. {b} rad)")
        speeds = tuple(min(j.speed_rad_s, v) for j, v in zip(arm.joints, spec.qd_max_rad_s, strict=True))
        t, (lo, hi) = BOW_M, motion.workspace_m
        speed, acceleration, jerk = motion.speed_m_s, motion.acceleration_m_s2, motion.jerk_m_s3
        rest_s = motion.leash_m / speed + speed / acceleration + acceleration / jerk
        return cls(
            q_min_rad=_vec6(low),
            q_max_rad=_vec6(high),
            joint_step_rad=_vec6(tuple(v * tick_s * (1.0 + SPEED_TOLERANCE) for v in speeds)),
            workspace_m=((lo[0] - t, lo[1] - t, lo[2] - FLOOR_BOW_M), (hi[0] + t, hi[1] + t, hi[2] + t)),
            tip_min_m=table_m + motion.table_clearance_m,
            tracking_error_rad=motion.tracking_error_rad,
            contact_n=motion.contact_force_n,
            hard_n=motion.hard_force_n,
            force_max_n=motion.force_limit_n,
            impact_max_n=motion.impact_limit_n,
            opening_m=(0.0, min(tool.stroke_m, spec.grip_stroke_m)),
            grip_force_n=tool.force_n,
            grip_speed_m_s=tool.speed_m_s,
            output_mask=(1 << spec.n_outputs) - 1,
            state_max_age_ns=round(motion.state_max_age_s * 1e9),
            percept_max_age_ns=round((motion.percept_max_age_s + motion.intent_max_age_s + rest_s) * 1e9),
            intent_max_age_ns=round((motion.intent_max_age_s + rest_s) * 1e9),
        )


def check_profile_fits(profile: Profile, spec: ArmSpec) -> None:
    """Check that a profile allows no joint more than the arm says it can do.

    Raises:
        RobotConfigError: the joint, what the arm says and what the profile gives.
    """
    ends = zip(profile.joints, spec.q_min_rad, spec.q_max_rad, spec.qd_max_rad_s, strict=True)
    for i, (joint, low, high, speed) in enumerate(ends):
        where = f"limits profile {profile.name}: joints[{i}]"
        if joint.range_rad[0] < low - AGREED or joint.range_rad[1] > high + AGREED:
            ours = f"{joint.range_rad[0]:.3f} .. {joint.range_rad[1]:.3f}"
            raise RobotConfigError(
                f"{where}.range_rad: expected a range within the arm's own {low:.3f} .. {high:.3f} rad, the file gives "
                f"{ours}: narrow it there"
            )
        if joint.speed_rad_s > speed + AGREED:
            raise RobotConfigError(
                f"{where}.speed_rad_s: expected at most the arm's own {speed:.3f} rad/s, the file gives "
                f"{joint.speed_rad_s:.3f}: lower it there"
            )


def _vec6(x: tuple[float, ...]) -> Vec6:
    return x[0], x[1], x[2], x[3], x[4], x[5]
