import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from config.loader import resolve
from sim_twin.controller.motion.limits import (
    Asked,
    Breach,
    Cause,
    Felt,
    Plane,
    breach_asked,
    breach_felt,
    default_limits,
    is_outside,
)

TWO_PI, PI = 2 * np.pi, resolve().arm.joints[0].speed_rad_s
LIMITS = msgspec.structs.replace(
    default_limits(resolve().arm),
    q_min_rad=(-TWO_PI,) * 6,
    q_max_rad=(TWO_PI,) * 6,
    planes=(Plane(normal=(0.0, 0.0, 1.0), offset_m=0.1),),
    tool_speed_m_s=1.5,
)


def at(i, value):
    out = np.zeros(6)
    out[i] = value
    return out


TOOL = np.array([0.3, 0, 0.3])


def asked(**changes):
    return Asked(**{"q_rad": np.zeros(6), "qd_rad_s": np.zeros(6), "tool_m": TOOL, "tool_before_m": TOOL} | changes)


def felt(**changes):
    still = {
        "q_rad": np.zeros(6), "qd_rad_s": np.zeros(6), "q_expected_rad": np.zeros(6), "tool_m": np.array([0, 0, 0.3]),
        "tool_velocity_m_s": np.zeros(3), "pressed_s": 0.0,
        "tool_speed_m_s": 0.0, "force_n": 0.0, "external_nm": np.zeros(6),
    }  # fmt: skip
    return Felt(**still | changes)


def after(x):
    return np.nextafter(x, np.inf)


def test_standing_still_is_always_allowed():
    assert breach_asked(LIMITS, asked()) is None
    assert breach_felt(LIMITS, felt()) is None


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("sign", [-1, 1])
@pytest.mark.parametrize(
    ("field", "limit", "cause"),
    [
        ("q_rad", TWO_PI, Cause.JOINT_LIMIT),
        ("qd_rad_s", PI * (1 + 1e-9), Cause.TARGET_SPEED),
        ("qd_rad_s", 2 * PI, Cause.JUMP),
    ],
)
def test_what_is_asked_may_be_at_the_limit_and_not_beyond(joint, sign, field, limit, cause):
    going = {"qd_rad_s": at(joint, sign * 0.1)}
    passes = breach_asked(LIMITS, asked(**going | {field: at(joint, sign * limit)}))
    assert passes is None or passes.cause is not cause
    breach = breach_asked(LIMITS, asked(**going | {field: at(joint, sign * after(limit))}))
    assert breach is not None
    assert (breach.cause, breach.joint, breach.cause.is_violation) == (cause, joint, False)


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize(
    ("field", "limits", "cause", "is_violation"),
    [
        ("qd_rad_s", [PI + np.radians(1.15)] * 6, Cause.JOINT_SPEED, False),
        ("qd_rad_s", [PI + np.radians(11)] * 6, Cause.JOINT_SPEED_VIOLATION, True),
        ("external_nm", LIMITS.collision_nm, Cause.JOINT_COLLISION, False),
        ("q_expected_rad", [LIMITS.deviation_rad] * 6, Cause.DEVIATION, False),
    ],
)
def test_what_is_felt_may_be_just_below_the_limit_and_not_just_above(joint, field, limits, cause, is_violation):
    below = breach_felt(LIMITS, felt(**{field: at(joint, limits[joint] - 1e-9)}))
    assert below is None or below.cause is not cause
    breach = breach_felt(LIMITS, felt(**{field: at(joint, -limits[joint] - 1e-9)}))
    assert breach is not None
    assert (breach.cause, breach.joint, breach.cause.is_violation) == (cause, joint, is_violation)


@pytest.mark.parametrize(
    ("field", "limit", "cause"),
    [
        ("tool_speed_m_s", 1.55, Cause.TOOL_SPEED),
        ("tool_speed_m_s", 1.65, Cause.TOOL_SPEED_VIOLATION),
        ("force_n", 250.0, Cause.TOOL_COLLISION),
    ],
)
def test_speed_and_force_of_the_tool(field, limit, cause):
    below, above = (breach_felt(LIMITS, felt(**{field: value})) for value in (limit - 1e-9, limit + 1e-9))
    assert below is None or below.cause is not cause
    assert above is not None
    assert above.cause is cause


def test_a_tool_is_asked_to_go_at_its_limit_and_not_faster():
    for way in (np.array([0.003, 0, 0]), np.array([0, -0.0018, 0.0024])):
        assert breach_asked(LIMITS, asked(tool_m=TOOL + way * (1 - 1e-9), tool_before_m=TOOL)) is None
        breach = breach_asked(LIMITS, asked(tool_m=TOOL + way * (1 + 1e-6), tool_before_m=TOOL))
        assert breach is not None
        assert (breach.cause, breach.cause.is_violation) == (Cause.TARGET_TOOL_SPEED, False)
    assert breach_asked(LIMITS, asked(tool_m=TOOL * np.nan)) is not None


def test_a_plane_stops_what_is_asked_and_four_centimetres_on_what_is_felt():
    def z(value):
        return np.array([0.3, 0, value])

    above = z(0.102)
    assert breach_asked(LIMITS, asked(tool_m=z(0.1), tool_before_m=above)) is None
    assert breach_asked(LIMITS, asked(tool_m=z(0.1 - 1e-9), tool_before_m=above)).cause is Cause.PLANE
    assert breach_asked(LIMITS, asked(tool_m=z(0.09), tool_before_m=z(0.09))) is None, "standing beyond it"
    assert breach_asked(LIMITS, asked(tool_m=z(0.09), tool_before_m=z(0.088))) is None, "coming back"
    further = np.array([0.3, 0.0, -after(0.005)])
    assert breach_felt(LIMITS, felt(tool_m=z(0.0600001), tool_velocity_m_s=further)) is None
    assert breach_felt(LIMITS, felt(tool_m=z(0.0599999), tool_velocity_m_s=further)).cause is Cause.PLANE_VIOLATION
    for velocity in (np.zeros(3), np.array([1.0, 0.0, -0.005]), np.array([0.0, 0.0, 0.5])):
        assert breach_felt(LIMITS, felt(tool_m=z(-1.0), tool_velocity_m_s=velocity)) is None, "standing, or coming back"
    nowhere = z(np.nan)
    assert breach_felt(LIMITS, felt(tool_m=nowhere, tool_velocity_m_s=nowhere)).cause is Cause.PLANE_VIOLATION


def test_a_plane_stops_what_could_not_stop_before_it():
    def z(value):
        return np.array([0.3, 0, value])

    going = {"tool_m": z(0.3), "tool_before_m": z(0.301)}
    assert breach_asked(LIMITS, asked(**going, tool_stop_m=(z(0.2), z(0.1)))) is None
    for places in ((z(0.2), z(0.1 - 1e-9)), (z(0.1 - 1e-9), z(0.2)), (z(0.2), z(np.nan))):
        assert breach_asked(LIMITS, asked(**going, tool_stop_m=places)).cause is Cause.PLANE
    back = {"tool_m": z(0.05), "tool_before_m": z(0.049)}
    assert breach_asked(LIMITS, asked(**back, tool_stop_m=(z(0.06), z(0.07)))) is None, "on the way back"


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_joint_beyond_its_limit_is_a_violation_only_where_it_goes_further(joint, sign):
    edge, further = TWO_PI + np.radians(5), at(joint, sign * after(0.01))
    beyond, within = at(joint, sign * (edge + 1e-9)), at(joint, sign * (edge - 1e-9))
    assert breach_felt(LIMITS, felt(q_rad=within, qd_rad_s=further, q_expected_rad=within)) is None
    breach = breach_felt(LIMITS, felt(q_rad=beyond, qd_rad_s=further, q_expected_rad=beyond))
    assert breach is not None
    assert (breach.cause, breach.joint) == (Cause.JOINT_VIOLATION, joint)
    for speed in (0.0, sign * 0.01, -sign * 1.0):
        assert breach_felt(LIMITS, felt(q_rad=beyond, qd_rad_s=at(joint, speed), q_expected_rad=beyond)) is None
    assert [is_outside(LIMITS, q, TOOL) for q in (within, beyond)] == [False, True]


def test_who_stands_beyond_a_plane_and_its_tolerance_is_outside():
    places = [np.array([0.3, 0, z]) for z in (0.0600001, 0.0599999, np.nan)]
    assert [is_outside(LIMITS, np.zeros(6), tool_m) for tool_m in places] == [False, True, True]


def test_only_a_force_that_lasts_is_a_violation():
    for force_n, pressed_s, cause in (
        (after(275.0), 0.5, Cause.FORCE_VIOLATION),
        (after(275.0), np.nextafter(0.5, 0.0), Cause.TOOL_COLLISION),
        (1e6, 0.0, Cause.TOOL_COLLISION),
        (275.0, 9.0, Cause.TOOL_COLLISION),
    ):
        breach = breach_felt(LIMITS, felt(force_n=force_n, pressed_s=pressed_s))
        assert breach is not None
        assert breach.cause is cause


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_a_number_is_refused(value):
    assert breach_asked(LIMITS, asked(q_rad=at(2, value))).cause is Cause.NOT_FINITE
    assert breach_felt(LIMITS, felt(q_rad=at(2, value))) is not None


@given(st.lists(st.floats(-10, 10), min_size=6, max_size=6), st.lists(st.floats(-10, 10), min_size=6, max_size=6))
def test_whatever_passes_is_inside(q, qd):
    if breach_asked(LIMITS, asked(q_rad=np.array(q), qd_rad_s=np.array(qd))) is None:
        assert all(abs(a) <= TWO_PI for a, b in zip(q, qd, strict=True) if a * b > 0.0)
        assert np.abs(qd).max() <= PI * (1 + 1e-8)


def test_codes_are_written_as_ur_writes_them():
    assert Breach(cause=Cause.DEVIATION, text="", joint=2).code == "C153A2"
    assert Breach(cause=Cause.TOOL_COLLISION, text="").code == "C158A0"
    assert Breach(cause=Cause.FORCE_VIOLATION, text="").code == ""
    assert len(list(Cause)) == len({c.value for c in Cause})


FAR = msgspec.structs.replace(LIMITS, planes=(Plane(normal=(0.0, 0.0, 1.0), offset_m=-1e6),))
"""No limit more than without planes, but every one of them is looked at by itself."""
OPEN = msgspec.structs.replace(LIMITS, planes=())
EDGES = [x for e in (0.0, PI, TWO_PI, 22.0, 110.0, 0.25, 1.5, 250.0) for x in (e, -e, after(e), np.nan, np.inf)]
NUMBERS = st.sampled_from(EDGES) | st.floats(-7.0, 7.0)
SIX = st.lists(NUMBERS, min_size=6, max_size=6).map(np.array)


@given(q=SIX, qd=SIX, i=st.integers(0, 5), odd=NUMBERS)
def test_who_is_plainly_within_what_is_asked_has_no_breach_limit_by_limit(q, qd, i, odd):
    for joints, speeds in ((q, qd), (at(i, odd), np.zeros(6)), (np.zeros(6), at(i, odd)), (at(i, odd), at(i, odd))):
        one = asked(q_rad=joints, qd_rad_s=speeds)
        assert breach_asked(OPEN, one) == breach_asked(FAR, one)


@given(
    i=st.integers(0, 5), odd=NUMBERS, other=NUMBERS, pressed_s=st.sampled_from([0.0, 1.0]),
    what=st.sampled_from(["q_rad", "qd_rad_s", "q_expected_rad", "external_nm"]),
)  # fmt: skip
def test_who_plainly_feels_nothing_has_no_breach_limit_by_limit(i, odd, other, pressed_s, what):
    for one in (
        felt(**{what: at(i, odd)}),
        felt(**{what: at(i, odd)}, force_n=abs(other), tool_speed_m_s=abs(odd), pressed_s=pressed_s),
    ):
        assert breach_felt(OPEN, one) == breach_felt(FAR, one)
        assert is_outside(OPEN, one.q_rad, one.tool_m) == is_outside(FAR, one.q_rad, one.tool_m)
