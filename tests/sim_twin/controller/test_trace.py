"""The twin's own joints in a file, and the faults that change what the arm is."""

from time import monotonic

import numpy as np
import pytest

from robot.layout import draw_layout
from sim_twin.controller import trace as traces
from sim_twin.controller.faults import FaultError, Faults
from sim_twin.controller.trace import TraceWriter, read_trace
from sim_twin.names import on_table
from tests.support.virtual_robot import make_robot, run


def test_what_was_written_is_read_while_it_grows_oldest_first(tmp_path, monkeypatch):
    monkeypatch.setattr(traces, "N_SLICES", 8)
    writer = TraceWriter(str(tmp_path / "trace"))
    for n in range(21):
        if n == 16:
            since = monotonic()
        writer.add(n, n == 20, np.full(6, n), np.full(6, -n))
        rows = read_trace(tmp_path / "trace")
        assert rows[:, 1].tolist() == list(range(max(0, n - 7), n + 1))
    assert rows[-1, 3:].tolist() == [20.0] * 6 + [-20.0] * 6
    assert rows[:, 2].tolist() == [1.0] * 7 + [0.0]
    assert read_trace(tmp_path / "trace", since_s=since)[:, 1].tolist() == [16, 17, 18, 19, 20]
    writer.close()


@pytest.fixture
def robot():
    made = make_robot()
    yield made
    made.close()


@pytest.fixture
def faults(robot):
    return Faults(robot, None, None)


def test_a_payload_that_the_controller_was_not_told_of_weighs_on_the_wrist(robot, faults):
    run(robot, 20)
    drive = robot.machine.drive
    held = drive.measured.q_rad.copy()
    faults.apply("payload", kg=3.0)
    run(robot, 400)
    assert drive.measured.wrench[2] == pytest.approx(-3.0 * 9.81, abs=0.5)
    assert 1e-4 < np.abs(drive.measured.q_rad - held).max() < 0.05
    faults.apply("payload")
    run(robot, 400)
    assert drive.measured.wrench[2] == pytest.approx(0.0, abs=0.5)
    assert drive.measured.q_rad == pytest.approx(held, abs=1e-3)
    with pytest.raises(FaultError, match="20 kg"):
        faults.apply("payload", kg=21.0)


def test_a_calibrated_arm_says_another_pose_for_the_same_joints(robot, faults):
    run(robot, 2)
    drive = robot.machine.drive
    nominal = drive.measured.tcp_pose[:3].copy()
    faults.apply("calibrate", mm=1.0, mrad=1.0)
    run(robot, 2)
    away = np.linalg.norm(drive.measured.tcp_pose[:3] - nominal)
    assert 1e-4 < away < 0.01
    assert drive.kinematics.rows != drive.kinematics.nominal
    faults.apply("calibrate")
    run(robot, 2)
    assert drive.measured.tcp_pose[:3] == pytest.approx(nominal, abs=1e-4)


def test_a_jog_moves_the_joints_by_as_much(robot, faults):
    run(robot, 2)
    before = robot.machine.world.data.qpos[:6].copy()
    faults.apply("jog", rad=[0.1, 0, 0, 0, 0, -0.1])
    run(robot, 800)
    assert robot.machine.world.data.qpos[:6] - before == pytest.approx([0.1, 0, 0, 0, 0, -0.1], abs=2e-3)
    with pytest.raises(FaultError, match="length 6"):
        faults.apply("jog", rad=[0.1])


def test_hands_lay_the_table_out_around_an_arm_that_stays_and_only_while_no_program_runs(robot, faults):
    run(robot, 20)
    world, before = robot.machine.world, robot.machine.drive.measured.q_rad.copy()
    faults.apply("lay_out", seed=5, epoch=2)
    run(robot, 20)
    layout = draw_layout(world.scenario, np.random.default_rng([5, 2]))
    for name, place in layout.fixtures_m.items():
        assert world.model.body(on_table(name)).pos[:2] == pytest.approx(place)
    assert np.abs(robot.machine.drive.measured.q_rad - before).max() < 1e-3
    robot.submit_script("def going():\n while True:\n  sync()\n end\nend\n")
    run(robot, 5)
    with pytest.raises(FaultError, match="stop the program first"):
        faults.apply("lay_out", seed=5, epoch=3)
    with pytest.raises(FaultError, match="seed"):
        faults.apply("lay_out", seed=-1, epoch=0)
