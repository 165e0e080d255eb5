"""Intents that are tried first: late by so many steps, refused before the arm gets there, let go of at once."""

import msgspec
import pytest

from config.loader import resolve
from robot.messages import Hold, Outcome, Twist, Verdict
from robot.rigs import build_shadow, build_station
from robot.teleop.preview import AheadPreview
from sim_twin.operator import SimulatedOperator

AHEAD = 10
REFUSED = Verdict(stamp_ns=0, sequence=1, outcome=Outcome.REFUSED, reason="force", is_latched=True)


def twist(y_m_s):
    return Twist(linear_m_s=(0.0, y_m_s, 0.0))


class Shadow:
    """Stops at a given attempt."""

    def __init__(self, stops_at=10**9):
        self.begun, self.tried, self.stops_at = 0, [], stops_at

    def begin(self, measured, percept):
        self.begun += 1
        self.tried = []

    def attempt(self, intent, duration_s):
        self.tried.append(intent)
        return REFUSED if len(self.tried) >= self.stops_at else None

    def close(self):
        pass


def offers(preview, intents):
    return [preview.offer(intent, None, None) for intent in intents]


def test_what_passes_is_sent_in_its_order_so_many_steps_late():
    shadow = Shadow()
    asked = [twist(0.001 * k) for k in range(30)]
    sent = offers(AheadPreview(shadow, n_ahead=AHEAD, step_s=0.02), asked)
    assert [intent for intent, _ in sent] == [Hold()] * AHEAD + asked[: 30 - AHEAD]
    assert shadow.tried == asked
    assert shadow.begun == 1


def test_what_stops_the_shadow_is_not_sent_nor_anything_after_it_until_the_driver_lets_go():
    shadow = Shadow(stops_at=15)
    preview = AheadPreview(shadow, n_ahead=AHEAD, step_s=0.02)
    sent = offers(preview, [twist(0.001 * k) for k in range(20)])
    assert [intent for intent, _ in sent[14:]] == [Hold()] * 6
    assert [verdict for _, verdict in sent[13:]] == [None] + [REFUSED] * 6
    assert len(shadow.tried) == 15
    assert preview.offer(Hold(), None, None) == (Hold(), None)
    shadow.stops_at = 10**9
    sent = offers(preview, [twist(0.1)] * (AHEAD + 1))
    assert sent[-1] == (twist(0.1), None)
    assert shadow.begun == 2


def test_letting_go_is_never_late():
    preview = AheadPreview(Shadow(), n_ahead=AHEAD, step_s=0.02)
    offers(preview, [twist(0.1)] * 30)
    assert preview.offer(Hold(), None, None) == (Hold(), None)
    assert preview.offer(twist(0.2), None, None) == (Hold(), None)


# ----------------------------------------------------------------------------------------------- on a real shadow


@pytest.fixture
def pair():
    """A station on the twin, and its shadow whose arm may be pushed less: it stops first."""
    resolved = resolve(rig="twin", scenario="paper")
    motion = msgspec.structs.replace(
        resolved.arm.motion, contact_force_n=1e4, hard_force_n=1e4, force_limit_n=60.0, impact_limit_n=60.0
    )
    timid = msgspec.structs.replace(resolved, arm=msgspec.structs.replace(resolved.arm, motion=motion))
    station, shadow = build_station(resolved), build_shadow(timid)
    SimulatedOperator().arm_once(station)
    station.reset(seed=1, epoch=0)
    yield station, shadow
    station.close()
    shadow.close()


def go_over(station, name):
    """Bring the tool over a thing, at travel height."""
    thing = next(thing for thing in station.percept.objects if thing.name == name)
    for _ in range(400):
        x, y, _ = (a - b for a, b in zip(thing.position_m, station.measured.tcp_position_m, strict=True))
        if abs(x) + abs(y) < 0.004:
            return
        station.step(Twist(linear_m_s=(min(max(3 * x, -0.2), 0.2), min(max(3 * y, -0.2), 0.2), 0.0)), duration_s=0.02)
    raise AssertionError("it never got there")


def test_the_shadow_is_where_the_arm_is_and_is_stopped_before_the_arm_comes_to_it(pair):
    station, shadow = pair
    go_over(station, "blue_box")
    preview = AheadPreview(shadow, n_ahead=AHEAD, step_s=0.02)
    down = Twist(linear_m_s=(0.0, 0.0, -0.25))
    most_n, refused = 0.0, None
    for _ in range(200):
        intent, refused = preview.offer(down, station.measured, station.percept)
        if refused is not None:
            break
        station.step(intent, duration_s=0.02)
        most_n = max(most_n, abs(station.measured.tcp_force_n[2]))
    assert refused is not None
    assert refused.reason == "force"
    for _ in range(20):
        intent, refused = preview.offer(down, station.measured, station.percept)
        assert intent == Hold()
        station.step(intent, duration_s=0.02)
        most_n = max(most_n, abs(station.measured.tcp_force_n[2]))
    assert most_n < 15.0
    assert station.state.mode == "engaged"


def test_a_shadow_that_was_stopped_may_be_tried_again(pair):
    station, shadow = pair
    for _ in range(2):
        shadow.begin(station.measured, station.percept)
        assert shadow.attempt(Hold(), 0.02) is None
        assert shadow.attempt(Twist(linear_m_s=(float("nan"), 0.0, 0.0)), 0.02) is not None
