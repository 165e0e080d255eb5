"""The newest message, while it is young enough, and why there is none."""

import pytest

from robot.bus.errors import SchemaError
from robot.bus.inlet import Inlet
from robot.bus.latest import Latest
from robot.bus.outlet import Outlet
from robot.bus.topics import TRUTH, ResetDone
from robot.errors import StaleStateError
from robot.messages import SceneState

MS = 1_000_000
LIMIT_NS = round(TRUTH.deadline_s * 1e9)


class Wire:
    """A bus of one subscriber, without a wire."""

    def __init__(self):
        self.now_ns, self.inlet = 10_000 * MS, Inlet(TRUTH, reader="reader", clock=1)

    @property
    def error(self):
        return self.inlet.error

    def subscriber(self, topic, on_message):
        self.on_message = on_message
        return self

    def put(self, message=None, *, clock=1):
        self.now_ns += 1  # each is a source that begins anew
        message = message or SceneState(stamp_ns=0, objects=())
        outlet = Outlet(type(message), source="twin", clock=clock, now_ns=lambda: self.now_ns)
        payload, attachment = outlet.wrap(message)
        received = self.inlet.take(attachment, payload, self.now_ns)
        if received is not None:
            self.on_message(received)


@pytest.fixture
def wire():
    return Wire()


@pytest.fixture
def latest(wire):
    return Latest(wire, TRUTH, writes="the twin", now_ns=lambda: wire.now_ns)


def test_before_the_first_there_is_none(latest):
    with pytest.raises(StaleStateError, match=r"twin/truth: .* none came yet; does the twin run"):
        latest.read()


@pytest.mark.parametrize("clock", [1, 2])
def test_a_message_is_read_up_to_its_deadline_and_not_a_nanosecond_longer(wire, latest, clock):
    wire.put(clock=clock)
    wire.now_ns += LIMIT_NS
    assert latest.read().message.objects == ()
    wire.now_ns += 1
    with pytest.raises(StaleStateError, match="not older than 100 ms, the newest is 100 ms old"):
        latest.read()


def test_where_the_writer_has_another_version_that_is_why_and_both_are_named(wire, latest):
    wire.put(ResetDone(seed=0, epoch=0))
    with pytest.raises(SchemaError, match=r"SceneState .* as reader has it, got .* from twin"):
        latest.read()
    wire.put()
    latest.read()
