"""What is started for a rig, how long to wait before it is started again, and who counts as silent."""

import msgspec
import pytest

from config.loader import load_rig
from config.rig import NodeStart
from robot.bus.envelope import Envelope, Origin
from robot.bus.inlet import Received
from robot.bus.station_rows import Health
from robot.errors import RobotConfigError
from robot.up.plan import BLAMED_S, FIRST_S, MANY, MOST_S, WITHIN_S, Backoff, is_own_end, plans_of
from robot.up.watch import GONE_S, SILENT_S, HealthBook

RIG = load_rig("virtual_lab")
VALUES = dict.fromkeys(("rig", "scenario", "address", "bus", "keys", "cell", "out"), "x")


def test_virtual_lab_starts_its_hub_then_what_holds_the_arm_then_what_commands_it():
    plans = plans_of(RIG, VALUES, more=("--epochs", "3"))
    assert [(plan.name, plan.kind) for plan in plans] == [
        ("twin", "hub"), ("recorder", "other"), ("perception", "perception"), ("robot", "robot"), ("learning", "job"),
    ]  # fmt: skip
    assert plans[-1].words[-2:] == ("--epochs", "3")
    assert not [word for plan in plans for word in plan.words if "{" in word]


def test_what_is_left_out_is_not_started_and_must_be_there():
    assert [plan.name for plan in plans_of(RIG, VALUES, without=("learning",))] == [
        "twin",
        "recorder",
        "perception",
        "robot",
    ]
    words = "--without: expected some of twin, recorder, perception, robot, learning, came printer"
    with pytest.raises(RobotConfigError, match=words):
        plans_of(RIG, VALUES, without=("printer",))


@pytest.mark.parametrize("word", ["{serial}", "{", "{}", "{rig.name}", "{0}"])
def test_a_word_with_another_name_in_braces_is_refused(word):
    nodes = (NodeStart(name="robot", kind="robot", command=("node", word)),)
    with pytest.raises(RobotConfigError, match="braces"):
        plans_of(msgspec.structs.replace(RIG, nodes=nodes), VALUES)


def test_a_rig_without_a_process_that_holds_its_arm_cannot_be_started():
    with pytest.raises(RobotConfigError, match="kind: robot"):
        plans_of(load_rig("twin"), VALUES)


def test_each_restart_waits_twice_as_long_and_too_many_are_given_up():
    backoff = Backoff()
    delays = [backoff.delay_s(float(k)) for k in range(MANY + 1)]
    assert delays[:-1] == [min(MOST_S, FIRST_S * 2**k) for k in range(MANY)]
    assert delays[-1] is None


def test_restarts_of_long_ago_count_no_more():
    backoff = Backoff()
    for k in range(3 * MANY):
        assert backoff.delay_s(k * (WITHIN_S + 1.0)) == FIRST_S


def test_ends_for_what_another_process_did_are_restarted_and_not_counted():
    backoff = Backoff()
    for k in range(3 * MANY):
        assert backoff.delay_s(float(k), is_own=False) == FIRST_S
    delays = [backoff.delay_s(100.0 + k) for k in range(MANY + 1)]
    assert delays[-2:] == [min(MOST_S, FIRST_S * 2 ** (MANY - 1)), None]
    assert backoff.delay_s(100.0 + MANY, is_own=False) is None


@pytest.mark.parametrize(
    ("kind", "ended_s", "is_own"),
    [
        ("job", None, True), ("job", 40.0, False), ("job", 40.0 - 1e-3, True),
        ("robot", 99.0, True), ("hub", 99.0, True), ("other", 99.0, True),
    ],
)  # fmt: skip
def test_only_a_job_s_end_is_put_down_to_what_it_needs_and_that_for_a_minute(kind, ended_s, is_own):
    assert is_own_end(kind, 40.0 + BLAMED_S, ended_s) is is_own


class Book:
    """A health book whose clock stands where it is told."""

    def __init__(self):
        self.now_s = 100.0
        self.book = HealthBook(("twin", "robot"), clock=7, now_s=lambda: self.now_s)
        for pid, name in enumerate(("twin", "robot")):
            self.book.begin(name, pid)

    def say(self, name, pid=None, *, is_leaving=False):
        own = ("twin", "robot").index(name) if pid is None else pid
        told = Health(pid=own, clock=7, now_ns=0, rate_hz=1.0, is_leaving=is_leaving)
        origin = Origin(schema=b"", clock=7, begun_ns=0, source=name)
        envelope = Envelope(origin=origin, sequence=0, stamp_ns=0)
        self.book.take(Received(message=told, envelope=envelope, arrived_ns=0, age_ns=0))


@pytest.mark.parametrize("limit_s", [SILENT_S, GONE_S])
def test_a_process_is_silent_beyond_its_time_and_not_before_it_was_heard(limit_s):
    told = Book()
    assert not told.book.is_silent("robot", for_s=limit_s, hub=None)
    told.say("robot")
    told.now_s += limit_s
    assert not told.book.is_silent("robot", for_s=limit_s, hub=None)
    told.now_s += 0.01
    assert told.book.is_silent("robot", for_s=limit_s, hub=None)


def test_a_process_that_said_that_it_leaves_is_not_silent():
    told = Book()
    told.say("robot")
    told.say("robot", is_leaving=True)
    told.now_s += 10.0
    assert not told.book.is_silent("robot", for_s=SILENT_S, hub=None)


def test_while_the_hub_is_silent_nobody_else_is_blamed():
    told = Book()
    told.say("twin")
    told.say("robot")
    told.now_s += 10.0
    assert told.book.is_silent("twin", for_s=SILENT_S, hub="twin")
    assert not told.book.is_silent("robot", for_s=SILENT_S, hub="twin")
    told.say("twin")
    assert told.book.is_silent("robot", for_s=SILENT_S, hub="twin")


def test_another_process_of_that_name_is_not_the_one_that_was_started():
    told = Book()
    told.say("robot", pid=99)
    assert told.book.age_s("robot") is None
    told.say("robot")
    assert told.book.age_s("robot") == 0.0
    told.book.begin("robot", 5)
    assert told.book.age_s("robot") is None
