"""What a servo process makes of a station that is silent, out of order, or says what nobody can understand."""

import math

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from robot.hal.fake import FakePlant
from robot.messages import Heading, Twist
from robot.servo_messages import Failure, StrideReply, pack_intent
from robot.servo_process import SILENT_AGES
from tests.support.hand_served import HandServed
from tests.support.stations import fake_rig

N_TICKS = 5
AHEAD = Heading(heading_rad=math.pi / 2, distance_m=0.02, height_m=0.225)
SILENT_NS = round(SILENT_AGES * fake_rig().arm.motion.intent_max_age_s * 1e9)
DEEP = b"\x91" * 5000 + b"\xc0"


class Host:
    """A host's time that is set by hand."""

    def __init__(self):
        self.ns = 10**15

    def __call__(self):
        return self.ns


@pytest.fixture(scope="module")
def host():
    return Host()


@pytest.fixture(scope="module")
def served(host):
    rig = fake_rig()
    return HandServed(rig, FakePlant(arm=rig.arm, scenario=rig.scenario, rig=rig.rig), host_ns=host)


@pytest.fixture
def server(served):
    """A server whose arm is under way."""
    served.seed()
    served.stride(AHEAD, n_ticks=N_TICKS)
    return served


def refusal(server):
    """Return the verdict of the one reply there is."""
    (reply,) = server.replies()
    assert isinstance(reply, StrideReply)
    return reply.stride.verdict


def assert_latched(server):
    """Nothing moves any more, whatever is asked, until somebody seeds it."""
    at_rad = server.loop.state.q_rad
    server.begin(AHEAD, n_ticks=N_TICKS)
    (reply,) = server.replies()
    assert isinstance(reply, Failure)
    assert server.loop.state.q_rad == at_rad
    server.seed()
    assert server.stride(AHEAD, n_ticks=N_TICKS).verdict is None


def test_a_station_may_be_silent_for_so_long_and_not_a_nanosecond_longer(server, host):
    host.ns += SILENT_NS
    assert server.stride(AHEAD, n_ticks=N_TICKS).verdict is None
    host.ns += SILENT_NS + 1
    server.begin(AHEAD, n_ticks=N_TICKS)
    verdict = refusal(server)
    assert (verdict.reason, verdict.is_latched) == ("stale_intent", True)
    assert "frozen" in verdict.detail
    assert_latched(server)


def test_before_its_first_time_step_a_station_may_take_its_time(server, host):
    server.seed()
    host.ns += 100 * SILENT_NS
    assert server.stride(AHEAD, n_ticks=N_TICKS).verdict is None


def test_a_station_that_waits_for_a_long_time_step_is_not_silent(server, host):
    server.begin(AHEAD, n_ticks=100)
    host.ns += 10 * SILENT_NS
    server.wait(100)
    assert refusal(server) is None
    assert server.stride(AHEAD, n_ticks=N_TICKS).verdict is None


@pytest.mark.parametrize("wrong_by", [-1, 1, -2, 10**6])
def test_a_time_step_that_is_not_the_next_one_is_refused(server, wrong_by):
    request = server.request(AHEAD, n_ticks=N_TICKS)
    odd = msgspec.structs.replace(request, sequence=request.sequence + wrong_by)
    server.send(msgspec.msgpack.encode(odd))
    assert refusal(server).reason == "sequence"
    assert_latched(server)


def bent(server, **changes):
    """Return a request as plain values, some of them changed."""
    request = msgspec.msgpack.decode(msgspec.msgpack.encode(server.request(AHEAD, n_ticks=N_TICKS)))
    return msgspec.msgpack.encode(request | changes)


@pytest.mark.parametrize(
    "raw",
    [
        b"",
        b"\xc1",
        b"garbage",
        bytes(range(256)),
        DEEP,
        msgspec.msgpack.encode(None),
        msgspec.msgpack.encode({"type": "StrideRequest"}),
        msgspec.msgpack.encode({"type": "Arm", "by": "the bus"}),
    ],
    ids=range(8),
)
def test_what_is_no_request_stops_the_arm_and_latches(server, raw):
    server.send(raw)
    verdict = refusal(server)
    assert (verdict.reason, verdict.is_latched) == ("malformed", True)
    assert_latched(server)


@pytest.mark.parametrize(
    "changes",
    [
        {"n_ticks": 0}, {"n_ticks": -1}, {"n_ticks": 1.5}, {"sequence": "next"}, {"grip": None},
        {"wait_at_m": [0.1, 0.2]}, {"type": "Close?"},
    ],
    ids=str,
)  # fmt: skip
def test_a_request_of_another_form_stops_the_arm_and_latches(server, changes):
    server.send(bent(server, **changes))
    assert refusal(server).reason == "malformed"
    assert_latched(server)


@pytest.mark.parametrize(
    ("intent", "reason"),
    [
        (Twist(linear_m_s=(math.nan, 0.0, 0.0)), "not_finite"),
        (Twist(linear_m_s=(math.inf, 0.0, 0.0)), "not_finite"),
        (Twist(linear_m_s=(0.0, 1e9, 0.0)), "out_of_reason"),
        ({"type": "Twist", "linear_m_s": [0.1, 0.2]}, "malformed"),
        ([], "malformed"),
    ],
)
def test_an_intent_that_is_none_stops_the_arm_and_latches(server, intent, reason):
    server.begin(intent, n_ticks=N_TICKS)
    assert refusal(server).reason == reason
    assert_latched(server)


@pytest.mark.parametrize(
    "packed", [DEEP, b"\xa2\xff\xfe", b"\xc7\x04\xff\x00\x00\x00\x00"], ids=["deep", "no text", "no time"]
)
def test_an_intent_that_cannot_even_be_read_is_refused_as_none(server, packed):
    request = server.request(AHEAD, n_ticks=N_TICKS)
    server.server._begin_stride(msgspec.structs.replace(request, intent=msgspec.Raw(packed)))
    assert refusal(server).reason == "malformed"
    assert_latched(server)


def test_a_place_to_wait_at_that_is_no_number_is_refused(server):
    request = server.request(AHEAD, n_ticks=N_TICKS, wait_at_m=(math.nan, 0.0, 0.0))
    server.send(msgspec.msgpack.encode(request))
    assert refusal(server).reason == "not_finite"
    assert_latched(server)


def test_a_grip_that_is_no_number_is_refused_at_its_first_tick(server):
    request = server.request(AHEAD, n_ticks=N_TICKS)
    grip = msgspec.structs.replace(request.grip, force_n=math.nan)
    server.send(msgspec.msgpack.encode(msgspec.structs.replace(request, grip=grip)))
    server.wait(1)
    assert refusal(server).reason == "not_finite"
    assert_latched(server)


def test_out_of_command_what_is_no_request_is_answered_so(server):
    server.send(b"garbage")
    assert refusal(server).reason == "malformed"
    server.send(b"garbage")
    (reply,) = server.replies()
    assert (reply.kind, reply.is_end) == ("WireError", False)


@given(raw=st.binary(max_size=200))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=50)
def test_no_bytes_end_the_process_or_move_the_arm(served, raw):
    at_rad = served.loop.state.q_rad
    served.send(raw)
    served.replies()
    assert served.loop.state.q_rad == at_rad


def test_what_cannot_cross_crosses_as_nothing():
    assert msgspec.msgpack.decode(pack_intent(object())) is None
