"""The perception node answers measurements with percepts at their stamps, and is silent where it does not know."""

import pytest

from perception.ground_truth import GroundTruthPerception
from perception.node import ARM_NS, PERIOD_NS, PerceptionNode, aged
from robot.bus import TRUTH
from robot.bus.envelope import Envelope, Origin
from robot.bus.inlet import Received
from robot.bus.topics import ARM_STATE, PERCEPT
from robot.messages import ObjectPose, SceneState
from tests.support.stations import arm_state, fake_rig

RIG = fake_rig()
NAMES = [thing.name for kind in ("buttons", "boxes", "cylinders") for thing in getattr(RIG.scenario, kind)]
ORIGIN = Origin(schema=b"", clock=7, begun_ns=0, source="robot")
Q = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)
TRUTH_NS = round(TRUTH.deadline_s * 1e9)


class Air:
    """What stands for a bus, and for its clock."""

    def __init__(self):
        self.now_ns, self.said, self.take = 10_000_000_000, [], {}
        perception = GroundTruthPerception(scenario=RIG.scenario, arm=RIG.arm)
        self.node = PerceptionNode(self, perception, RIG.scenario, now_ns=lambda: self.now_ns)

    def subscriber(self, topic, on_message):
        self.take[topic.name] = on_message
        return self

    def publisher(self, topic):
        assert topic is PERCEPT
        return self

    def put(self, percept, *, stamp_ns):
        self.said.append((percept, stamp_ns))

    def come(self, topic, message, *, ago_ns=0):
        at_ns = self.now_ns - ago_ns
        envelope = Envelope(origin=ORIGIN, sequence=0, stamp_ns=at_ns)
        self.take[topic.name](Received(message=message, envelope=envelope, arrived_ns=self.now_ns, age_ns=ago_ns))

    def truth(self, *, ago_ns=0):
        things = tuple(
            ObjectPose(name=name, position_m=(0.4, 0.1 * k, 0.02), quat=(1.0, 0.0, 0.0, 0.0))
            for k, name in enumerate(NAMES)
        )
        self.come(TRUTH, SceneState(stamp_ns=1, objects=things), ago_ns=ago_ns)

    def arm(self, *, ago_ns=0):
        self.come(ARM_STATE, arm_state(Q, stamp_ns=self.now_ns - ago_ns), ago_ns=ago_ns)


def test_a_measurement_is_answered_at_once_with_the_percept_at_its_stamp_and_the_age_of_what_was_seen():
    air = Air()
    air.truth(ago_ns=7_000_000)
    air.arm()
    air.node.turn()
    ((percept, stamp_ns),) = air.said
    assert (percept.stamp_ns, stamp_ns) == (air.now_ns, air.now_ns - 7_000_000)
    ages = dict(zip(RIG.scenario.distances, percept.ages_s, strict=False))
    assert ages.pop("table") == 0.0
    assert all(age_s == pytest.approx(0.007) for age_s in ages.values())
    assert all(thing.age_s == pytest.approx(0.007) for thing in percept.objects)
    assert percept.ages_s[len(RIG.scenario.distances) :] == (0.0,) * len(RIG.scenario.buttons)
    air.arm()
    air.node.turn()
    assert len(air.said) == 2


def test_between_measurements_it_perceives_at_its_rate():
    air = Air()
    air.truth()
    air.arm()
    air.node.turn()
    air.now_ns += PERIOD_NS - 1
    air.truth()
    air.node.turn()
    assert len(air.said) == 1
    air.now_ns += 1
    air.node.turn()
    assert len(air.said) == 2


@pytest.mark.parametrize(("ago_ns", "n"), [(TRUTH_NS, 1), (TRUTH_NS + 1, 0)])
def test_without_fresh_truth_it_is_silent(ago_ns, n):
    air = Air()
    air.truth(ago_ns=ago_ns)
    air.arm()
    air.node.turn()
    assert len(air.said) == n


@pytest.mark.parametrize(("ago_ns", "n"), [(ARM_NS, 1), (ARM_NS + 1, 0)])
def test_without_a_measurement_of_late_it_is_silent(ago_ns, n):
    air = Air()
    air.truth()
    air.arm(ago_ns=ago_ns)
    air.node.turn()
    assert len(air.said) == n


def test_a_percept_that_is_aged_by_nothing_is_the_same():
    air = Air()
    air.truth()
    air.arm()
    air.node.turn()
    percept, _ = air.said[0]
    assert aged(percept, 0.0, (True,) * len(RIG.scenario.distances)) == percept
