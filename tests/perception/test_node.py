"""The perception node answers measurements with percepts at their stamps, and is silent where it does not know."""

import pytest

from perception.cameras.over_bus import FrameCounts
from perception.ground_truth import GroundTruthPerception
from perception.node import ARM_NS, LIGHT_NS, PERIOD_NS, PerceptionNode, aged
from robot.bus import TRUTH
from robot.bus.camera_rows import Forgotten, Light
from robot.bus.envelope import Envelope, Origin
from robot.bus.inlet import Received
from robot.bus.topics import ARM_STATE, FORGET, LIGHT, PERCEPT
from robot.frames import CameraSpec
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
        self.now_ns, self.said, self.take, self.asked = 10_000_000_000, [], {}, []
        self.lights = []
        perception = GroundTruthPerception(scenario=RIG.scenario, arm=RIG.arm)
        self.node = PerceptionNode(self, perception, RIG.scenario, now_ns=lambda: self.now_ns)

    def subscriber(self, topic, on_message):
        self.take[topic.name] = on_message
        return self

    def publisher(self, topic):
        assert topic in (PERCEPT, LIGHT)
        return self

    def answerer(self, query):
        assert query is FORGET
        return self

    def next(self):
        return self.asked.pop() if self.asked else None

    def put(self, message, *, stamp_ns=None):
        if isinstance(message, Light):
            self.lights.append(message)
        else:
            self.said.append((message, stamp_ns))

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


class Asked:
    """A question that waits."""

    def __init__(self):
        self.replies = []

    def answer(self, reply):
        self.replies.append(reply)


class Seeing:
    """A perception by camera, and the camera in one: it tells what it was asked, and gives a percept."""

    counts = FrameCounts(read=7, lost=3, torn=1, late=2)
    spec = camera_spec = CameraSpec(name="table", serial="", width_px=640, height_px=480, rate_hz=20.0)
    shown_ns = None

    def __init__(self):
        self.asked, self.n_forgotten = [], 0
        self.truth = GroundTruthPerception(scenario=RIG.scenario, arm=RIG.arm)

    def watch(self, cameras):
        pass

    def connect(self):
        pass

    def close(self):
        pass

    def forget(self):
        self.n_forgotten += 1

    def perceive(self, arm, scene):
        self.asked.append((arm, scene))
        things = tuple(ObjectPose(name=name, position_m=(0.4, 0.1, 0.02), quat=(1.0, 0.0, 0.0, 0.0)) for name in NAMES)
        return self.truth.perceive(arm, SceneState(stamp_ns=1, objects=things))


def looking():
    air, seeing = Air(), Seeing()
    air.take = {}
    air.node = PerceptionNode(air, seeing, RIG.scenario, camera=seeing, now_ns=lambda: air.now_ns)
    return air, seeing


def test_by_camera_no_truth_is_heard_and_the_percept_is_at_the_measurement():
    air, seeing = looking()
    assert list(air.take) == [ARM_STATE.name]
    air.arm(ago_ns=4_000_000)
    air.node.turn()
    ((state, scene),) = seeing.asked
    ((percept, stamp_ns),) = air.said
    assert scene is None
    assert state.stamp_ns == percept.stamp_ns == stamp_ns == air.now_ns - 4_000_000
    assert air.node.pulse.doing == "perceives: 7 frames, 3 lost, 1 torn, 2 late"


def test_a_measurement_of_another_machine_is_looked_at_by_its_arrival_and_answered_by_its_own_stamp():
    air, seeing = looking()
    origin = Envelope(origin=ORIGIN, sequence=0, stamp_ns=5)
    message = arm_state(Q, stamp_ns=5)
    air.take[ARM_STATE.name](Received(message=message, envelope=origin, arrived_ns=air.now_ns, age_ns=None))
    air.node.turn()
    ((state, _),) = seeing.asked
    ((percept, stamp_ns),) = air.said
    assert (state.stamp_ns, percept.stamp_ns, stamp_ns) == (air.now_ns, 5, air.now_ns)


def test_a_table_that_was_laid_out_is_forgotten_by_perception_and_camera_before_that_is_answered():
    air, seeing = looking()
    asked = Asked()
    air.asked.append(asked)
    air.node.turn()
    assert seeing.n_forgotten == 2, "the perception and its camera"
    assert asked.replies == [Forgotten()]
    truth, also = Air(), Asked()
    truth.asked.append(also)
    truth.node.turn()
    assert also.replies == [Forgotten()]


def test_twice_a_second_it_is_told_for_how_long_no_picture_showed_the_table():
    air, seeing = looking()
    air.now_ns += LIGHT_NS - 1
    air.node.turn()
    assert not air.lights
    air.now_ns += 1
    air.node.turn()
    air.node.turn()
    seeing.shown_ns = air.now_ns
    air.now_ns += LIGHT_NS
    air.node.turn()
    seeing.shown_ns = air.now_ns - 40_000_000
    air.now_ns += LIGHT_NS
    air.node.turn()
    assert [light.dark_s for light in air.lights] == [0.5, 0.5, 0.54]
    assert {light.camera for light in air.lights} == {"table"}
