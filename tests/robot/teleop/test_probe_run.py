"""The probe list on a twin in lock-step: what it comes to there, what a latch leaves of it, and who attends."""

from collections import deque

import msgspec
import pytest
from typer.testing import CliRunner

from config.loader import resolve
from robot.cli import app
from robot.errors import SafetyError
from robot.hal.sight import Sight
from robot.messages import StationMode
from robot.person import PersonOperator
from robot.rigs import build_station
from robot.teleop.attending import NobodyAsked, attending
from robot.teleop.probe_judge import judge_probe
from robot.teleop.probe_run import ProbeRun
from robot.teleop.probes import STEP_S, plan, probe_rig_of
from sim_twin.operator import SimulatedOperator
from tests.support.small_lab import make_lab

TWIN = resolve(rig="twin")


class Seen:
    """A station whose every step is seen, by a clock that knows steps alone."""

    def __init__(self, station):
        self._station, self.sights, self.n_steps = station, deque(), 0

    def now_ns(self):
        return round(self.n_steps * STEP_S * 1e9)

    def step(self, intent, *, duration_s):
        self.n_steps += 1
        result = self._station.step(intent, duration_s=duration_s)
        state = self.measured
        self.sights.append(
            Sight(
                seen_ns=self.now_ns(), plant_s=state.stamp_ns / 1e9, q_rad=state.q_rad, qd_rad_s=state.qd_rad_s,
                tcp_m=state.tcp_position_m, tcp_speed_m_s=state.tcp_speed_m_s, digital_out=state.digital_out,
                mode=state.mode, is_program_running=True,
            )
        )  # fmt: skip
        return result

    def __getattr__(self, name):
        return getattr(self._station, name)


@pytest.fixture(scope="module")
def listed():
    """The list for the twin's arm at the start of an epoch, and its station, engaged under the narrowed profile."""
    before = build_station(TWIN)
    SimulatedOperator().arm_once(before)
    before.reset(seed=3, epoch=0)
    tool_m = before.measured.tcp_position_m
    before.close()
    probes, box = plan(tool_m, TWIN.arm.motion.workspace_m, tilt_rad=0.0)
    narrowed = probe_rig_of(TWIN, box)
    station = build_station(narrowed, is_driven=True)
    SimulatedOperator().arm_once(station)
    station.reset(seed=3, epoch=0)
    yield probes, Seen(station), narrowed.profile.stopping
    station.close()


CHOSEN = ("y", "release", "wall")
"""All of them go over the wire, in a slow test."""


def test_probes_keep_what_they_are_asked_on_the_twin(listed):
    probes, seen, stopping = listed
    run = ProbeRun(station=seen, sights=seen.sights, now_ns=seen.now_ns, pause=lambda _: None)
    rows = [row for probe in probes if probe.name in CHOSEN for row in judge_probe(run.run(probe), stopping)]
    assert [row for row in rows if not row.ok] == []
    assert {row.name.split("_")[0] for row in rows} == set(CHOSEN)
    assert run.refusal == ""


def test_after_a_latch_nothing_of_the_list_moves_any_more(listed):
    probes, seen, stopping = listed
    run = ProbeRun(station=seen, sights=seen.sights, now_ns=seen.now_ns, pause=lambda _: None)
    seen.stop(by="somebody")
    rows = {row.name: row for row in judge_probe(run.run(probes[1]), stopping)}
    assert not rows["x_refused"].ok if "x_refused" in rows else not rows["x_looks"].ok
    assert "stopped by somebody" in run.refusal
    n_steps = seen.n_steps
    run.run(probes[2])
    assert seen.n_steps == n_steps
    assert seen.state.mode is StationMode.LATCHED


# ------------------------------------------------------------------------------------------------- who attends


def lab_rig(folder, **rig):
    return make_lab(folder, "127.0.0.78", operator="robot.person:PersonOperator", **rig)


def test_a_list_that_a_person_must_attend_is_refused_without_a_terminal(tmp_path, monkeypatch):
    def never(*_, **__):
        raise AssertionError("nothing may be built")

    monkeypatch.setattr("robot.teleop.probe.build_plant", never)
    scenario = tmp_path / "small.yaml"
    rig = lab_rig(tmp_path)
    came = CliRunner().invoke(app, ["teleop", "check", "--rig", str(rig), "--scenario", str(scenario), "--probe"])
    assert came.exit_code == 1
    assert "expected a person at a terminal" in came.output
    assert "nothing moves" in came.output


def test_a_virtual_arm_is_moved_with_nobody_there_and_a_real_one_never():
    rig = resolve(rig="virtual_lab").rig
    _, attendant = attending(rig, is_terminal=False)
    assert isinstance(attendant, NobodyAsked)
    real = msgspec.structs.replace(rig, expected=msgspec.structs.replace(rig.expected, kind="real"))
    with pytest.raises(SafetyError, match="person at a terminal"):
        attending(real, is_terminal=False)
    operator, attendant = attending(resolve(rig="lab").rig, is_terminal=True)
    assert isinstance(operator, PersonOperator)
    assert not isinstance(attendant, NobodyAsked)
