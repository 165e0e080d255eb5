"""The truth over the bus: what is none, or old, is no truth, whoever published it."""

import msgspec
import pytest

from robot.bus.twin_link import RemoteTruth
from robot.errors import StaleStateError
from robot.messages import SceneState

SCENE = msgspec.json.encode(SceneState(stamp_ns=1, objects=()))


class Sample:
    def __init__(self, raw):
        self.payload, self._raw = self, raw

    def to_bytes(self):
        return self._raw


class Session:
    """A bus on which anybody may publish."""

    def declare_subscriber(self, key, take_in):
        self.key, self._take_in = key, take_in

    def publish(self, raw):
        self._take_in(Sample(raw))


@pytest.fixture
def bus():
    return Session()


@pytest.mark.parametrize(
    "raw",
    [b"", b"\x00\xff", b"{}", b'{"stamp_ns": 0, "objects": "none"}', b'{"stamp_ns": NaN, "objects": []}', b"[" * 5000],
)
def test_garbage_in_place_of_the_truth_is_told_as_a_truth_that_is_not_known(bus, raw):
    truth = RemoteTruth(bus, "1")
    bus.publish(SCENE)
    assert truth.read().objects == ()
    bus.publish(raw)
    with pytest.raises(StaleStateError, match=f"came {len(raw)} bytes of none"):
        truth.read()
    bus.publish(SCENE)
    assert truth.read().objects == ()


def test_before_the_first_message_nothing_is_known(bus):
    with pytest.raises(StaleStateError, match="none came yet"):
        RemoteTruth(bus, "1").read()
