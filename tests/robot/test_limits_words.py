"""Each limit is the one that the files and the arm give, and what does not fit is told, whole."""

import math

import pytest
from msgspec.structs import replace

from config.loader import load_arm
from robot.errors import RobotConfigError
from robot.hal.fake import FakeArm
from robot.safety import GateLimits, check_profile_fits
from tests.support.profiles import profile
from tests.support.words import says

ARM = load_arm("ur5e")
SPEC = FakeArm(arm=ARM, tick_s=0.01).spec


def test_limits_say_what_does_not_fit():
    with pytest.raises(RobotConfigError, match=says("the rig's arm file is for 'ur5e', the plant says 'ur10e'")):
        GateLimits.of(ARM, replace(SPEC, model="ur10e"), table_m=0.0, tick_s=0.01)
    high = ARM.joints[0].range_rad[1]
    message = f"joint base: file and arm leave no range ({high} .. {high} rad)"
    with pytest.raises(RobotConfigError, match=says(message)):
        GateLimits.of(ARM, replace(SPEC, q_min_rad=(high, *SPEC.q_min_rad[1:])), table_m=0.0, tick_s=0.01)


def test_every_limit_is_the_one_that_file_and_arm_give():
    spec = replace(SPEC, q_min_rad=(-1.0,) * 6, q_max_rad=(2.0,) * 6, qd_max_rad_s=(0.5,) * 6, n_outputs=3)
    motion, tool = ARM.motion, ARM.tool
    (x0, y0, z0), (x1, y1, z1) = motion.workspace_m
    rest_s = (
        motion.leash_m / motion.speed_m_s
        + motion.speed_m_s / motion.acceleration_m_s2
        + motion.acceleration_m_s2 / motion.jerk_m_s3
    )
    assert GateLimits.of(ARM, spec, table_m=0.125, tick_s=0.01) == GateLimits(
        q_min_rad=(-1.0,) * 6,
        q_max_rad=(2.0,) * 6,
        joint_step_rad=(0.5 * 0.01 * (1.0 + 1e-9),) * 6,
        workspace_m=((x0 - 0.01, y0 - 0.01, z0 - 0.005), (x1 + 0.01, y1 + 0.01, z1 + 0.01)),
        tip_min_m=0.125 + motion.table_clearance_m,
        tracking_error_rad=motion.tracking_error_rad,
        contact_n=motion.contact_force_n,
        hard_n=motion.hard_force_n,
        force_max_n=motion.force_limit_n,
        impact_max_n=motion.impact_limit_n,
        opening_m=(0.0, tool.stroke_m),
        grip_force_n=tool.force_n,
        grip_speed_m_s=tool.speed_m_s,
        output_mask=0b111,
        state_max_age_ns=round(motion.state_max_age_s * 1e9),
        percept_max_age_ns=round((motion.percept_max_age_s + motion.intent_max_age_s + rest_s) * 1e9),
        intent_max_age_ns=round((motion.intent_max_age_s + rest_s) * 1e9),
    )


def test_each_joint_has_its_own_limits_and_ages_are_to_the_nanosecond():
    low, high = tuple(-1.0 - k for k in range(6)), tuple(0.5 + 0.25 * k for k in range(6))
    speeds = tuple(0.5 + 0.1 * k for k in range(6))
    slow = replace(ARM, motion=replace(ARM.motion, state_max_age_s=5.0, intent_max_age_s=5.0))
    limits = GateLimits.of(
        slow, replace(SPEC, q_min_rad=low, q_max_rad=high, qd_max_rad_s=speeds), table_m=0.0, tick_s=1.0
    )
    plain = GateLimits.of(ARM, SPEC, table_m=0.0, tick_s=1.0)
    assert limits.q_min_rad == (*low[:2], max(low[2], ARM.joints[2].range_rad[0]), *low[3:])
    assert limits.q_max_rad == high
    assert limits.joint_step_rad == pytest.approx(speeds)
    assert limits.state_max_age_ns == 5 * 10**9
    shorter_s = 5.0 - ARM.motion.intent_max_age_s
    assert abs(limits.intent_max_age_ns - plain.intent_max_age_ns - shorter_s * 1e9) <= 1.0


@pytest.mark.parametrize("name", ["q_min_rad", "q_max_rad", "qd_max_rad_s"])
def test_an_arm_of_another_number_of_joints_is_an_error_and_never_cut_short(name):
    longer = replace(SPEC, **{name: (*getattr(SPEC, name), 0.0)})
    with pytest.raises(ValueError, match="zip"):
        GateLimits.of(ARM, longer, table_m=0.0, tick_s=0.01)
    with pytest.raises(ValueError, match="zip"):
        check_profile_fits(profile(), longer)


@pytest.mark.parametrize("i", range(6))
def test_a_profile_at_the_arms_limits_and_a_rounding_passes_and_the_next_float_does_not(i):
    edge = replace(
        profile().joints[i],
        range_rad=(SPEC.q_min_rad[i] - 1e-3, SPEC.q_max_rad[i] + 1e-3),
        speed_rad_s=SPEC.qd_max_rad_s[i] + 1e-3,
    )
    (low, high), speed = edge.range_rad, edge.speed_rad_s

    def held(joint):
        return profile(joints=tuple(joint if k == i else j for k, j in enumerate(profile().joints)))

    check_profile_fits(held(edge), SPEC)
    for beyond in (
        replace(edge, range_rad=(math.nextafter(low, -math.inf), high)),
        replace(edge, range_rad=(low, math.nextafter(high, math.inf))),
        replace(edge, speed_rad_s=math.nextafter(speed, math.inf)),
    ):
        with pytest.raises(RobotConfigError):
            check_profile_fits(held(beyond), SPEC)


@pytest.mark.parametrize("i", range(6))
def test_a_profile_may_differ_from_the_arm_by_rounding_and_no_more(i):
    held = profile()
    low, high = held.joints[i].range_rad
    speed = held.joints[i].speed_rad_s

    def but(values, value):
        return tuple(value if k == i else v for k, v in enumerate(values))

    for by, fits in ((0.0009, True), (0.0011, False)):
        for spec, message in (
            (replace(SPEC, q_min_rad=but(SPEC.q_min_rad, low + by)),
             f"limits profile {held.name}: joints[{i}].range_rad: expected a range within the arm's own "
             f"{low + by:.3f} .. {SPEC.q_max_rad[i]:.3f} rad, the file gives {low:.3f} .. {high:.3f}: "
             "narrow it there"),
            (replace(SPEC, q_max_rad=but(SPEC.q_max_rad, high - by)),
             f"limits profile {held.name}: joints[{i}].range_rad: expected a range within the arm's own "
             f"{SPEC.q_min_rad[i]:.3f} .. {high - by:.3f} rad, the file gives {low:.3f} .. {high:.3f}: "
             "narrow it there"),
            (replace(SPEC, qd_max_rad_s=but(SPEC.qd_max_rad_s, speed - by)),
             f"limits profile {held.name}: joints[{i}].speed_rad_s: expected at most the arm's own {speed - by:.3f} "
             f"rad/s, the file gives {speed:.3f}: lower it there"),
        ):  # fmt: skip
            if fits:
                check_profile_fits(held, spec)
            else:
                with pytest.raises(RobotConfigError, match=says(message)):
                    check_profile_fits(held, spec)
