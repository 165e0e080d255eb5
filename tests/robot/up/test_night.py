"""A run that nobody attends ends by itself where it has to, tells somebody, and leaves a report."""

import sys

import msgspec
import pytest

from config.loader import load_rig
from robot.bus.camera_rows import Light
from robot.bus.station_rows import StationReport
from robot.errors import RobotConfigError
from robot.messages import StationMode, StationState
from robot.up.morning import morning_report
from robot.up.night import (
    BYTES_AN_HOUR,
    DARK_S,
    HOUR_S,
    LEAST_FREE_BYTES,
    MOST_AN_HOUR,
    MOST_IN_8_H,
    SHIFT_S,
    LightWatch,
    StopBudget,
    check_night,
)
from robot.up.night_watch import NightWatch
from robot.up.summary import Event, NodeSummary, Summary, Worst


def report(n_latches, *reasons, begun=1):
    state = StationState(mode=StationMode.DISARMED)
    return StationReport(revision=1, begun=begun, state=state, n_latches=n_latches, latch_reasons=reasons)


def budget_of(*at_s):
    budget = StopBudget()
    for n, when_s in enumerate(at_s, start=1):
        budget.take(report(n, *["speed"] * n), when_s)
    return budget


def test_more_than_three_stops_in_an_hour_are_too_many_and_three_are_not():
    assert budget_of(*[0.0] * MOST_AN_HOUR).why_spent(0.0) is None
    budget = budget_of(*[0.0] * (MOST_AN_HOUR + 1))
    assert budget.why_spent(HOUR_S - 1e-6) == "expected at most 3 stops in an hour, came 4, the last for speed"
    assert budget.why_spent(HOUR_S) is None


def test_more_than_twenty_five_in_eight_hours_are_too_many_and_twenty_five_are_not():
    assert budget_of(*[0.0] * MOST_IN_8_H).why_spent(HOUR_S) is None
    budget = budget_of(*[0.0] * (MOST_IN_8_H + 1))
    assert "at most 25 stops in 8 h, came 26" in (budget.why_spent(SHIFT_S - 1e-6) or "")
    assert budget.why_spent(SHIFT_S) is None


def test_a_report_that_comes_again_counts_once_and_a_new_robot_node_counts_from_nothing():
    budget = StopBudget()
    budget.take(report(2, "speed", "wire"), 1.0)
    budget.take(report(2, "speed", "wire"), 2.0)
    assert [stop.reason for stop in budget.stops] == ["speed", "wire"]
    budget.take(report(0, begun=2), 3.0)
    budget.take(report(1, "stop", begun=2), 4.0)
    assert (budget.n, budget.stops[-1].reason) == (3, "stop")


def test_stops_whose_reasons_are_not_told_any_more_count_too():
    budget = StopBudget()
    budget.take(report(5, "speed"), 1.0)
    assert (budget.n, len(budget.stops)) == (5, 5)


@pytest.mark.parametrize(("spare", "is_enough"), [(0, True), (-1, False)])
def test_there_must_be_room_for_the_night(spare, is_enough):
    free = LEAST_FREE_BYTES + 10 * BYTES_AN_HOUR + spare
    if is_enough:
        check_night(load_rig("virtual_lab"), hours=10.0, free_bytes=free)
    else:
        with pytest.raises(RobotConfigError, match="GB free for 10 h"):
            check_night(load_rig("virtual_lab"), hours=10.0, free_bytes=free)


def test_a_real_arm_without_a_safeguard_input_is_not_left_alone():
    rig = load_rig("lab")
    with pytest.raises(RobotConfigError, match="safeguard_input"):
        check_night(rig, hours=1.0, free_bytes=10**12)
    check_night(msgspec.structs.replace(rig, safeguard_input=0), hours=1.0, free_bytes=10**12)


@pytest.mark.parametrize(("free", "is_over"), [(LEAST_FREE_BYTES, False), (LEAST_FREE_BYTES - 1, True)])
def test_a_disk_that_runs_full_ends_the_run(tmp_path, monkeypatch, free, is_over):
    monkeypatch.setattr("robot.up.night_watch.shutil.disk_usage", lambda _: type("Usage", (), {"free": free}))
    assert (NightWatch(tmp_path).why_over(0.0) is not None) is is_over


def test_whoever_is_to_be_told_is_and_a_command_that_fails_ends_nothing(tmp_path):
    said, told, script = [], tmp_path / "told", tmp_path / "alert.py"
    script.write_text(f"import sys\nopen({str(told)!r}, 'w').write(sys.argv[1])\n")
    NightWatch(tmp_path, alert=f"{sys.executable} {script}").tell("it ended")
    assert told.read_text() == "it ended"
    script.write_text("raise SystemExit(4)")
    NightWatch(tmp_path, alert=f"{sys.executable} {script}", say=said.append).tell("it ended")
    assert said == ["alert: ended with exit code 4: "]
    with pytest.raises(RobotConfigError, match="--alert"):
        NightWatch(tmp_path, alert="no-such-command-here")


def test_the_morning_report_tells_how_it_ended_its_stops_and_what_was_started_again():
    node = NodeSummary(
        name="robot", n_starts=2, exit_code=0, most_late_ms=3.0, most_mb=200.0, grown_mb=5.0, last_error="a|b"
    )
    summary = Summary(
        rig="lab", seconds=7200.0, exit_code=int(Worst.FAILED), nodes=(node,),
        events=(Event(at_s=1.0, node="robot", what="started as process 5"),), stop_first_ms=1.0, stop_last_ms=1.0,
        logs="logs",
    )  # fmt: skip
    text = morning_report(summary, budget_of(10.0).stops, n_stops=1, why_over="too many")
    assert text.startswith("# lab: 2.0 h, it failed\n")
    for told in ("* ended: too many", "0.50 an hour", "| robot | 2 | 200 MB | 5 MB | 3 ms | a/b |", "* 10 s: speed"):
        assert told in text


def test_a_table_that_is_dark_for_longer_than_a_minute_ends_the_night_and_a_minute_does_not():
    light = LightWatch()
    assert light.why_dark() is None
    light.take(Light(camera="table", dark_s=DARK_S))
    assert light.why_dark() is None
    light.take(Light(camera="table", dark_s=DARK_S + 0.01))
    assert "camera table: expected pictures of a lit table, none came for 60 s" in (light.why_dark() or "")
    light.take(Light(camera="table", dark_s=0.1))
    assert light.why_dark() is None


def test_a_watch_ends_the_night_for_the_light_that_perception_tells_of(tmp_path, monkeypatch):
    monkeypatch.setattr("robot.up.night_watch.shutil.disk_usage", lambda _: type("Usage", (), {"free": 10**12}))

    class Air:
        """What stands for a bus."""

        def subscriber(self, topic, on_message):
            taken[topic.name] = on_message

    class Came:
        message = Light(camera="table", dark_s=2.0 * DARK_S)

    taken, watch = {}, NightWatch(tmp_path)
    watch.listen(Air(), lambda: 0.0)
    assert watch.why_over(1.0) is None
    taken["camera/light"](Came())
    assert "lit table" in (watch.why_over(1.0) or "")
