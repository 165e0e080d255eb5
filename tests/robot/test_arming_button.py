"""A press of the wired arming button: after the question, in its time, once; held before or bouncing it is none."""

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from config.errors import ConfigError
from config.loader import load_cell
from config.wiring import check_cell_fits
from robot.errors import SafetyError
from robot.hal.fake import FakePlant
from robot.messages import PlantIdentity, PlantKind, StationMode
from robot.person import PersonOperator
from robot.rigs import build_station
from robot.safety import AnsweredBy, ArmingButton, PressWatch
from robot.safety.arming_button import GAP_NS, SETTLE_NS
from robot.safety.challenge import LIFE_NS
from tests.support.stations import fake_rig
from tests.support.words import HostTime

MS = 1_000_000
SIGNAL = 9
BIT = 1 << SIGNAL
REAL = PlantIdentity(kind=PlantKind.REAL, model="ur5e", serial="20225500001")


def seen(levels, *, every_ns=10 * MS):
    """Return after which looks, one each so long, the watch says pressed."""
    watch = PressWatch()
    return [k for k, is_on in enumerate(levels) if watch.see(is_on=is_on, now_ns=k * every_ns)]


def test_a_press_counts_once_it_has_settled_after_a_settled_release():
    assert seen([False] * 4 + [True] * 5) == [7, 8]


def test_two_looks_at_one_instant_are_no_gap():
    watch, looks = PressWatch(), ((False, 0), (False, SETTLE_NS), (False, SETTLE_NS), (True, SETTLE_NS + 1))
    assert not any(watch.see(is_on=is_on, now_ns=now_ns) for is_on, now_ns in looks)
    assert watch.see(is_on=True, now_ns=2 * SETTLE_NS + 1)


def test_a_button_held_from_before_does_not_count_until_it_was_let_go():
    assert seen([True] * 50) == []
    assert seen([True] * 10 + [False] * 4 + [True] * 4) == [17]


def test_a_button_that_bounces_counts_when_it_has_come_to_rest():
    bouncing = [True, False, True, False, True, True, False]
    assert seen([False] * 4 + bouncing + [True] * 4) == [14]
    assert seen([False] * 4 + bouncing * 20) == []


def test_a_release_that_only_bounces_is_none():
    assert seen([True] * 10 + [False, True] * 20 + [True] * 10) == []


@pytest.mark.parametrize(("held_ns", "is_pressed"), [(SETTLE_NS - 1, False), (SETTLE_NS, True)])
def test_either_level_settles_at_its_time_and_not_a_nanosecond_before(held_ns, is_pressed):
    for off_ns, on_ns in ((SETTLE_NS, held_ns), (held_ns, SETTLE_NS)):
        watch = PressWatch()
        watch.see(is_on=False, now_ns=0)
        watch.see(is_on=False, now_ns=off_ns)
        watch.see(is_on=True, now_ns=off_ns + 1)
        assert watch.see(is_on=True, now_ns=off_ns + 1 + on_ns) is is_pressed


@pytest.mark.parametrize(("gap_ns", "is_pressed"), [(GAP_NS, True), (GAP_NS + 1, False), (-1, False)])
def test_what_was_not_looked_at_for_longer_than_the_gap_begins_anew(gap_ns, is_pressed):
    watch = PressWatch()
    watch.see(is_on=False, now_ns=0)
    watch.see(is_on=False, now_ns=SETTLE_NS)
    watch.see(is_on=True, now_ns=SETTLE_NS + gap_ns)
    assert watch.see(is_on=True, now_ns=SETTLE_NS + gap_ns + SETTLE_NS) is is_pressed


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(st.booleans(), st.integers(1, 60)), max_size=40))
def test_whatever_counts_was_off_and_then_on_for_long_enough(looks):
    watch, now_ns, history = PressWatch(), 0, []
    for is_on, after_ms in looks:
        now_ns += after_ms * MS
        history.append((now_ns, is_on))
        if watch.see(is_on=is_on, now_ns=now_ns):
            last_off = max(k for k, (_, on) in enumerate(history) if not on)
            assert now_ns - history[last_off + 1][0] >= SETTLE_NS
            runs, begun = [], None
            for at_ns, on in history[: last_off + 1]:
                begun = None if on else at_ns if begun is None else begun
                runs.append(0 if begun is None else at_ns - begun)
            assert max(runs) >= SETTLE_NS


@pytest.fixture
def button():
    host = HostTime()
    return ArmingButton(signal=SIGNAL, now_ns=host), host


def press(button, host, *, begin_ns=0):
    """Release and press; return what the last look says."""
    host.now_ns += begin_ns
    for bits, after_ns in ((0, 0), (0, SETTLE_NS), (BIT, 1), (BIT, SETTLE_NS)):
        host.now_ns += after_ns
        answer = button.see(bits)
    return answer


def test_a_press_is_the_answer_once(button):
    button, host = button
    button.ask("0417")
    answer = press(button, host)
    assert answer.by is AnsweredBy.WIRED
    assert answer.is_code("0417")
    with pytest.raises(SafetyError, match="answered already"):
        button.see(BIT)


def test_another_input_is_no_press(button):
    button, host = button
    button.ask("0417")
    for bits in (0, 0, ~BIT & 0xFFFF, ~BIT & 0xFFFF):
        host.now_ns += SETTLE_NS
        assert button.see(bits) is None


@pytest.mark.parametrize(("after_ns", "is_taken"), [(LIFE_NS, True), (LIFE_NS + 1, False)])
def test_a_press_is_good_at_the_last_nanosecond_of_ten_seconds_and_not_at_the_next(button, after_ns, is_taken):
    button, host = button
    button.ask("0417")
    begin_ns = after_ns - 2 * SETTLE_NS - 1
    for ahead_ns in range(0, begin_ns, GAP_NS):
        host.now_ns = 5_000_000_000 + ahead_ns
        button.see(0)
    host.now_ns = 5_000_000_000
    if is_taken:
        assert press(button, host, begin_ns=begin_ns) is not None
    else:
        with pytest.raises(SafetyError, match="within 10 s"):
            press(button, host, begin_ns=begin_ns)
        with pytest.raises(SafetyError, match="nothing was asked"):
            button.see(0)


def test_a_press_before_anybody_asked_is_an_error_and_a_new_question_begins_anew(button):
    button, host = button
    words = "^a press of the arming button: nothing was asked, or it was answered already$"
    with pytest.raises(SafetyError, match=words):
        button.see(BIT)
    button.ask("0417")
    host.now_ns += SETTLE_NS
    assert button.see(0) is None
    button.ask("9920")
    for _ in range(4):
        host.now_ns += SETTLE_NS
        assert button.see(BIT) is None


# ------------------------------------------------------------------------------------------------------- a station


class Presser:
    """Stands at the cell: sets the button's input before each look, by a script of levels."""

    def __init__(self, plant, host, levels):
        self.plant, self.host, self.levels = plant, host, iter(levels)
        self.keys, self.told = [], []

    def tell(self, text):
        self.told.append(text)

    def await_key(self, text):
        self.keys.append(text)

    def confirm(self, text):
        self.await_key(text)

    def ask(self, text):
        raise AssertionError(text)

    def wait(self, seconds):
        self.host.now_ns += round(seconds * 1e9)
        self.plant.arm.digital_in = BIT if next(self.levels, False) else 0


@pytest.fixture
def cell():
    """A real arm as far as anybody can tell, with a wired button, its pendant, and its host's clock."""
    resolved, host, pendant = fake_rig(), HostTime(), []
    expected = msgspec.structs.replace(resolved.rig.expected, kind="real", serial=REAL.serial)
    wired = msgspec.structs.replace(load_cell("ur_box"), arming_signal=SIGNAL)
    rig = msgspec.structs.replace(resolved.rig, expected=expected)
    resolved = msgspec.structs.replace(resolved, rig=rig, cell=wired)
    plant = FakePlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
    plant.identity = REAL
    station = build_station(resolved, plant=plant, host_ns=host, cell_shows=pendant.append)
    yield station, plant, host, pendant
    station.close()


def test_a_real_arm_is_armed_by_a_press_that_answers_what_its_pendant_shows(cell):
    station, plant, host, pendant = cell
    person = Presser(plant, host, [False] * 6 + [True, False] + [True] * 8)
    PersonOperator(person, wait=person.wait).arm_once(station)
    assert station.state.mode is StationMode.ENGAGED
    assert "press the arming button, or type" in pendant[0]
    assert "release the arming button" in person.told[0]


def test_a_press_may_clear_a_latch_and_is_asked_for_anew(cell):
    station, plant, host, pendant = cell
    press = [False] * 6 + [True] * 8
    person = Presser(plant, host, press)
    PersonOperator(person, wait=person.wait).arm_once(station)
    station.stop(by="somebody")
    held = Presser(plant, host, [True] * 2000)
    with pytest.raises(SafetyError, match="within 10 s"):
        PersonOperator(held, wait=held.wait).rearm(station, seed=1, epoch=0)
    assert station.state.mode is StationMode.LATCHED
    again = Presser(plant, host, press)
    PersonOperator(again, wait=again.wait).rearm(station, seed=1, epoch=0)
    assert station.state.mode is StationMode.ENGAGED
    assert len(pendant) == 3


def test_a_button_held_from_before_arms_nothing(cell):
    station, plant, host, _ = cell
    plant.arm.digital_in = BIT
    person = Presser(plant, host, [True] * 2000)
    with pytest.raises(SafetyError, match="within 10 s"):
        PersonOperator(person, wait=person.wait).arm_once(station)
    assert station.state.mode is StationMode.DISARMED


def test_a_station_without_a_button_says_so():
    station = build_station(fake_rig(), plant=None)
    assert not station.has_button
    with pytest.raises(SafetyError, match="arming_signal"):
        station.pressed()


def test_a_button_of_the_table_arms_nothing():
    scenario = fake_rig().scenario
    wired = msgspec.structs.replace(load_cell("ur_box"), arming_signal=scenario.buttons[0].input)
    with pytest.raises(ConfigError, match=r"arming_signal.*does not use"):
        check_cell_fits(scenario, wired, "cell.yaml")
