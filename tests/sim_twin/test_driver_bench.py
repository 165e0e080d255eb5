"""What the limits cost an honest driver: the bench's own parts tell the truth of what they drive at."""

from importlib.metadata import entry_points

import pytest
from msgspec.structs import replace

from config.loader import resolve
from robot.bench import BENCH_GROUP
from sim_twin.driver_bench import bench_driver, clearance_trials, fence_trials, joint_trials

RESOLVED = resolve()
ATTENDED = replace(RESOLVED, rig=replace(RESOLVED.rig, profile="attended"))


def named(trials, name):
    return next(trial for trial in trials(ATTENDED) if trial.name == name)


def test_a_drive_at_a_face_of_the_box_rests_at_it_and_not_a_hand_before():
    row = named(fence_trials, "box_y_high").row()
    assert row.ok
    assert 0.0 <= row.value < 5.0
    assert "box" in row.details["limited by"]


def test_a_face_that_is_never_reached_is_told_as_space_that_was_not_used():
    trial = named(fence_trials, "box_y_high")
    row = replace(trial, resolved=replace(trial.resolved, arm=ATTENDED.arm), gap=lambda _: (0.2, 0.05)).row()
    assert not row.ok
    assert row.value == pytest.approx(50.0)
    assert row.details["way used"] == "75.0 %"


@pytest.mark.parametrize(
    ("name", "group"), [("driver", "sim_twin.driver_bench"), ("safety", "sim_twin.checking.bench")]
)
def test_the_bench_is_registered(name, group):
    (point,) = [p for p in entry_points(group=BENCH_GROUP) if p.name == name]
    assert point.value.startswith(group)


def test_every_joint_is_driven_at_both_its_ends():
    names = {trial.name for trial in joint_trials(ATTENDED)}
    assert names == {f"joint_{i}_{side}" for i in range(1, 7) for side in ("low", "high")}


@pytest.mark.slow
def test_shaping_costs_an_honest_driver_no_more_than_it_may_and_fences_leave_no_space_unused():
    rows = {row.name: row for row in bench_driver(full=False).results}
    assert rows["reach_time_ratio"].ok
    for trials in (fence_trials, clearance_trials):
        for trial in trials(ATTENDED):
            assert rows[f"left_{trial.name}"].ok, rows[f"left_{trial.name}"]
