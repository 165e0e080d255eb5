"""The arm as a profile leaves it: of each limit that both name, the smaller. Pure."""

import msgspec

from config.arm import ArmConfig, Joint, MotionLimits, Tool
from config.limits import ArmPart, JointLimit, Profile
from config.values import Point

__all__ = ["FENCE_MARGIN_M", "SPEED_SHARE", "limited"]

FENCE_MARGIN_M = 1e-3
"""Motion keeps this far inside of a fence, so that the gate never meets one by rounding."""
SPEED_SHARE = 0.98
"""Share of a profile's greatest speeds of the tool that motion uses."""
HARD_SHARE = 0.4
"""Of the lasting force, so much is the most that a push may be to be given way to no faster than joints may brake."""


def limited(arm: ArmConfig, profile: Profile) -> ArmConfig:
    """Return the arm with no limit wider than the profile's; the same arm where it has none."""
    joints = [_joint(joint, limit) for joint, limit in zip(arm.joints, profile.joints, strict=True)]
    base, shoulder, elbow, wrist_1, wrist_2, wrist_3 = joints
    return msgspec.structs.replace(
        arm,
        joints=(base, shoulder, elbow, wrist_1, wrist_2, wrist_3),
        tool=_tool(arm.tool, profile),
        motion=_motion(arm.motion, profile),
    )


def _joint(joint: Joint, limit: JointLimit) -> Joint:
    return msgspec.structs.replace(
        joint,
        range_rad=_narrowed(joint.range_rad, limit.range_rad),
        speed_rad_s=min(joint.speed_rad_s, limit.speed_rad_s),
        acceleration_rad_s2=min(joint.acceleration_rad_s2, limit.acceleration_rad_s2),
        jerk_rad_s3=min(joint.jerk_rad_s3, limit.jerk_rad_s3),
    )


def _tool(tool: Tool, profile: Profile) -> Tool:
    grip = profile.grip
    return msgspec.structs.replace(
        tool, force_n=_narrowed(tool.force_n, grip.force_n), speed_m_s=_narrowed(tool.speed_m_s, grip.speed_m_s)
    )


def _motion(motion: MotionLimits, profile: Profile) -> MotionLimits:
    speed, force = SPEED_SHARE * profile.speeds.tcp_m_s, profile.contact_force
    return msgspec.structs.replace(
        motion,
        speed_m_s=min(motion.speed_m_s, speed),
        guarded_speed_m_s=min(motion.guarded_speed_m_s, speed),
        max_step_m=min(motion.max_step_m, speed * motion.step_s),
        workspace_m=_fenced(motion.workspace_m, profile),
        # Fingers may touch things, not the table. Motion itself stays a margin higher than this.
        table_clearance_m=max(motion.table_clearance_m, profile.clearances.scene_m - FENCE_MARGIN_M),
        hard_force_n=max(motion.contact_force_n, min(motion.hard_force_n, HARD_SHARE * force.steady_n)),
        force_limit_n=min(motion.force_limit_n, force.steady_n),
        impact_limit_n=min(motion.impact_limit_n, force.blow_n),
    )


def _fenced(workspace_m: tuple[Point, Point], profile: Profile) -> tuple[Point, Point]:
    """Return the box that the tool's target may be in, its faces a margin inside of the profile's boxes."""
    low, high = (list(corner) for corner in workspace_m)
    for box in profile.workspace.boxes:
        if ArmPart.TCP in box.parts:
            low = [max(a, b + FENCE_MARGIN_M) for a, b in zip(low, box.low_m, strict=True)]
            high = [min(a, b - FENCE_MARGIN_M) for a, b in zip(high, box.high_m, strict=True)]
    return (low[0], low[1], low[2]), (high[0], high[1], high[2])


def _narrowed(ours: tuple[float, float], theirs: tuple[float, float]) -> tuple[float, float]:
    return max(ours[0], theirs[0]), min(ours[1], theirs[1])
