"""What each of the gate's checks says when it refuses: reason, words and amount, once each, and its exact edges."""

import math

import pytest
from msgspec.structs import replace

from robot.messages import ArmMode, GripCommand, Heading, Hold, JointTarget, Twist
from robot.safety import GateLimits, Reason
from robot.safety.checks import (
    check_finite,
    check_force,
    check_grip,
    check_intent,
    check_intent_age,
    check_joint_range,
    check_joint_speed,
    check_outputs,
    check_push,
    check_sequence,
    check_state,
    check_tool,
    check_tracking,
)
from tests.support.stations import arm_state, command

LIMITS = GateLimits(
    q_min_rad=(-1.0, -2.0, -3.0, -4.0, -5.0, -6.0),
    q_max_rad=(1.5, 2.5, 3.5, 4.5, 5.5, 6.5),
    joint_step_rad=(0.125, 0.25, 0.5, 0.125, 0.25, 0.5),
    workspace_m=((-1.0, -2.0, -3.0), (1.5, 2.5, 3.5)),
    tip_min_m=0.25,
    tracking_error_rad=0.25,
    contact_n=15.0,
    hard_n=90.0,
    force_max_n=250.0,
    impact_max_n=700.0,
    opening_m=(0.0, 0.5),
    grip_force_n=(20.0, 200.0),
    grip_speed_m_s=(0.25, 0.75),
    output_mask=0xFFFF,
    state_max_age_ns=50_000_000,
    percept_max_age_ns=650_000_000,
    intent_max_age_ns=500_000_000,
)
REST = (0.0,) * 6
GRIP = GripCommand(opening_m=0.25, force_n=100.0, speed_m_s=0.5)
NOW_NS = 10**9
MOST = 1.7e308


def joint(i, value):
    return tuple(value if k == i else 0.0 for k in range(6))


def gripping(**changes):
    plain = {"opening_m": 0.25, "force_n": 100.0, "speed_m_s": 0.5}
    return command(REST, grip=GripCommand(**(plain | changes)))


def aged(*, state_ns=0, command_ns=0, mode=ArmMode.RUNNING):
    state = arm_state(REST, stamp_ns=NOW_NS - state_ns, mode=mode)
    return check_state(state, command(REST, stamp_ns=NOW_NS - command_ns), NOW_NS, LIMITS)


def heading(a=1.0, d=0.02, z=0.2, **grip):
    return check_intent(Heading(heading_rad=a, distance_m=d, height_m=z, **grip))


R = Reason
TOLD = [
    (lambda: check_intent("left"), R.MALFORMED, "expected Heading, Twist, JointTarget or Hold, came str", 0.0),
    (lambda: heading(grip="wide"), R.MALFORMED, "expected grip open, close or nothing, came 'wide'", 0.0),
    (lambda: heading(a="north"), R.MALFORMED, "expected numbers in Heading: must be real number, not str", 0.0),
    (lambda: check_intent(JointTarget(q_rad=REST[:4])), R.MALFORMED, "expected 6 numbers in JointTarget, came 4", 0.0),
    (lambda: heading(a=math.nan), R.NOT_FINITE, "expected finite numbers in Heading, came (nan, 0.02, 0.2)", 0.0),
    (lambda: heading(a=1002.0), R.OUT_OF_REASON, "expected at most 1000, came 1002", 2.0),
    (lambda: heading(z=-10.5), R.OUT_OF_REASON, "expected at most 10, came -10.5", 0.5),
    (lambda: heading(d=-0.01), R.OUT_OF_REASON, "expected a distance of 0 or more, came -0.01 m", 0.0),
    (lambda: check_finite(command(REST[:5])), R.MALFORMED, "expected 6 joints, came 5", 0.0),
    (lambda: check_finite(command(joint(1, math.inf), grip=GRIP)), R.NOT_FINITE,
     f"expected finite joints and grip, came {joint(1, math.inf)}, {GRIP}", 0.0),
    (lambda: check_finite(command(None)), R.MALFORMED,
     "expected numbers in the command: object of type 'NoneType' has no len()", 0.0),
    (lambda: check_finite(command(REST, digital_out=None)), R.MALFORMED, "expected outputs as bits, came None", 0.0),
    (lambda: check_sequence(command(REST, sequence=6), 3), R.SEQUENCE, "expected command 4, came 6", 0.0),
    (lambda: aged(state_ns=60_000_000), R.STALE_STATE, "expected a state of 0 to 50 ms, came 60 ms", 0.06),
    (lambda: aged(state_ns=-2_000_000), R.STALE_STATE, "expected a state of 0 to 50 ms, came -2 ms", -0.002),
    (lambda: aged(command_ns=70_000_000), R.STALE_STATE, "expected a command of 0 to 50 ms, came 70 ms", 0.07),
    (lambda: aged(mode=ArmMode.PROTECTIVE_STOP), R.ARM_MODE,
     f"expected a running arm, it is {ArmMode.PROTECTIVE_STOP}", 0.0),
    (lambda: check_intent_age(10**9, 1_600_000_000, LIMITS), R.STALE_INTENT,
     "expected rest 0.5 s after an intent, came motion at 0.6 s", 0.0),
    (lambda: check_joint_range(joint(2, 4.0), LIMITS), R.JOINT_RANGE, "joint 3: expected -3 to 3.5 rad, came 4", 0.5),
    (lambda: check_joint_range(joint(1, -2.25), LIMITS), R.JOINT_RANGE,
     "joint 2: expected -2 to 2.5 rad, came -2.25", 0.25),
    (lambda: check_joint_speed(joint(0, 1.0), joint(0, 1.25), LIMITS), R.JOINT_SPEED,
     "joint 1: expected a change of at most 0.125 rad a tick, came -0.25", 0.125),
    (lambda: check_tool((1.0, 3.0, 0.00004), 1.0, LIMITS), R.WORKSPACE,
     "expected the tool within (-1.0, -2.0, -3.0) to (1.5, 2.5, 3.5) m, came (1.0, 3.0, 0.0)", 0.5),
    (lambda: check_tool((-2.0, 0.0, 0.00016), 1.0, LIMITS), R.WORKSPACE,
     "expected the tool within (-1.0, -2.0, -3.0) to (1.5, 2.5, 3.5) m, came (-2.0, 0.0, 0.0002)", 1.0),
    (lambda: check_tool((0.0, 0.0, 0.0), 0.125, LIMITS), R.TABLE,
     "expected fingertips at 0.25 m or higher, came 0.125", 0.125),
    (lambda: check_tracking(joint(4, 1.0), joint(4, 0.5), LIMITS), R.TRACKING,
     "joint 5: expected it within 0.25 rad, came -0.5", 0.25),
    (lambda: check_force(800.0, 0.0, LIMITS), R.FORCE,
     "expected at most 250 N on the tool (700 in a blow), came 800", 550.0),
    (lambda: check_push((0.0, 0.0, 240.0), 225.0, (0.0, 0.0, -0.001), LIMITS), R.FORCE,
     "expected at most 250 N on the tool by the next tick, it presses on at 240", 5.0),
    (lambda: check_grip(gripping(opening_m=0.75), LIMITS), R.GRIP,
     "grip.opening_m: expected 0 to 0.5, came 0.75", 0.25),
    (lambda: check_grip(gripping(force_n=15.0), LIMITS), R.GRIP,
     "grip.force_n: expected 20 to 200, came 15", 5.0),
    (lambda: check_grip(gripping(speed_m_s=1.0), LIMITS), R.GRIP,
     "grip.speed_m_s: expected 0.25 to 0.75, came 1", 0.25),
    (lambda: check_outputs(command(REST, digital_out=0x10001), LIMITS), R.OUTPUTS,
     "expected bits within 0xffff, came 0x10001", 0.0),
]  # fmt: skip


@pytest.mark.parametrize(("check", "reason", "detail", "amount"), TOLD)
def test_a_refusal_says_what_was_expected_what_came_and_by_how_much(check, reason, detail, amount):
    refusal = check()
    assert (refusal.reason, refusal.detail) == (reason, detail)
    assert refusal.amount == pytest.approx(amount, abs=1e-12)


FINE = replace(LIMITS, state_max_age_ns=50_000_070, intent_max_age_ns=5_000_005_001)


def test_ages_are_told_to_six_digits_and_none_is_off():
    late = check_state(arm_state(REST, stamp_ns=-60_000_000), command(REST), 0, FINE)
    assert late.detail == "expected a state of 0 to 50.0001 ms, came 60 ms"
    old = check_intent_age(0, 6_000_005_001, FINE)
    assert old.detail == "expected rest 5.00001 s after an intent, came motion at 6.00001 s"


def linear(i, value):
    return Twist(linear_m_s=tuple(value if k == i else 0.0 for k in range(3)))


def angular(i, value):
    return Twist(linear_m_s=(0.0,) * 3, angular_rad_s=tuple(value if k == i else 0.0 for k in range(3)))


SIZES = [
    (lambda v: Heading(heading_rad=v, distance_m=0.0, height_m=0.0), 1e3),
    (lambda v: Heading(heading_rad=0.0, distance_m=abs(v), height_m=0.0), 10.0),
    (lambda v: Heading(heading_rad=0.0, distance_m=0.0, height_m=v), 10.0),
    *((lambda v, i=i: linear(i, v), 10.0) for i in range(3)),
    *((lambda v, i=i: angular(i, v), 1e3) for i in range(3)),
    *((lambda v, i=i: JointTarget(q_rad=joint(i, v)), 1e3) for i in range(6)),
]


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(("made", "most"), SIZES)
def test_an_intent_at_the_size_that_can_be_meant_passes_and_the_next_float_does_not(made, most, sign):
    assert check_intent(made(sign * most)) is None
    assert check_intent(made(sign * math.nextafter(most, math.inf))).reason is Reason.OUT_OF_REASON


def test_a_distance_of_nothing_passes_and_the_next_float_under_it_does_not():
    assert heading(d=0.0) is None
    assert heading(d=math.nextafter(0.0, -1.0)).reason is Reason.OUT_OF_REASON


def test_a_hold_has_no_numbers_to_refuse():
    assert check_intent(Hold()) is None


@pytest.mark.parametrize("name", ["opening_m", "force_n", "speed_m_s"])
def test_numbers_so_large_that_they_add_up_to_infinity_are_refused_as_if_they_were(name):
    grip = GripCommand(**({"opening_m": 0.0, "force_n": 0.0, "speed_m_s": 0.0} | {name: MOST}))
    assert check_finite(command(joint(0, MOST), grip=grip)).reason is Reason.NOT_FINITE
    assert check_finite(command(joint(0, -MOST), grip=grip)) is None


def test_a_fingertip_at_its_least_height_passes_and_the_next_float_does_not():
    assert check_tool((0.0, 0.0, 0.0), 0.25, LIMITS) is None
    assert check_tool((0.0, 0.0, 0.0), math.nextafter(0.25, 0.0), LIMITS).reason is Reason.TABLE
    assert check_tool((0.0, 0.0, 0.0), math.nan, LIMITS).reason is Reason.TABLE


@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize("axis", range(3))
def test_a_tool_on_the_edge_of_the_workspace_passes_and_the_next_float_does_not(axis, side):
    limit = LIMITS.workspace_m[side][axis]

    def at(value):
        return tuple(value if k == axis else 0.0 for k in range(3))

    assert check_tool(at(limit), 1.0, LIMITS) is None
    beyond = math.nextafter(limit, math.inf if side else -math.inf)
    assert check_tool(at(beyond), 1.0, LIMITS).reason is Reason.WORKSPACE


@pytest.mark.parametrize(
    "check",
    [
        lambda q: check_joint_range(q, LIMITS),
        lambda q: check_joint_speed(q, REST, LIMITS),
        lambda q: check_tracking(q, REST, LIMITS),
    ],
)
def test_joints_of_another_number_are_an_error_and_never_cut_short(check):
    with pytest.raises((TypeError, IndexError), match=r"matching|range"):
        check(REST[:5])
