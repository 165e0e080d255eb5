"""`teleop check` of an arm on a wire: streams end at a shadow's gate, nothing is sent to it; a probe list moves it."""

import json
import re
import threading
import time

import numpy as np
import pytest

from config.loader import load_arm
from robot.kinematics import ToolChain
from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup
from sim_twin.controller.trace import read_trace
from tests.support.loopback import own_address
from tests.support.overbooked import OVERBOOKED_SHARE, Overbooked
from tests.support.small_lab import autotelic, controller_of, make_lab
from tests.support.terminal import Session

pytest.importorskip("rtde_receive", reason="the genuine client comes with `pip install autotelic[lab]`")

pytestmark = pytest.mark.realtime

SHORT = ("--blocks", "1", "--commands", "20", "--workers", "1", "--json")


def check(folder, *words, timeout_s=120):
    return autotelic(
        folder, "teleop", "check", "--rig", folder / "rig.yaml", "--scenario", folder / "small.yaml",
        "--profile", "attended", *words, timeout_s=timeout_s,
    )  # fmt: skip


def has_run_a_program(controller):
    return any("program" in line.lower() for line in controller.fault("log")["lines"])


@pytest.fixture
def lab(tmp_path):
    """A small lab's folder and its virtual controller, with the trace of the twin's own joints."""
    host = own_address()
    make_lab(tmp_path, host)
    with controller_of(tmp_path, host, cell="ur_box", trace=str(tmp_path / "trace")) as controller:
        yield tmp_path, controller


def test_a_check_in_shadow_says_so_and_leaves_the_arm_where_it_was(lab):
    folder, controller = lab
    before = controller.fault("truth")
    code, out, err = check(folder, *SHORT, "--out", "kept")
    report = json.loads(out)
    assert code == 0, err
    assert report["is_shadow"]
    assert report["arm"]["serial"] == "20215501234"
    assert report["arm"]["is_table_perceived"]
    rows = {row["name"]: row for row in report["results"]}
    assert rows["streams"]["value"] == 8
    assert rows["arm_moved_rad"]["value"] <= 1e-3
    kept = json.loads((folder / "kept/check.json").read_text())
    assert kept["arm"] == report["arm"]
    assert (folder / "kept/margins.png").stat().st_size > 10_000
    after = controller.fault("truth")
    assert after["q_rad"] == pytest.approx(before["q_rad"], abs=1e-6)
    assert after["runtime"] == "STOPPED"
    assert not has_run_a_program(controller)


@pytest.mark.slow
def test_an_arm_that_moves_meanwhile_ends_the_check_with_an_error(lab):
    folder, controller = lab

    def jog():
        time.sleep(6.0)
        while not over.is_set():
            controller.fault("jog", rad=[0.0, 0.0, 0.0, 0.0, 0.0, 0.05])
            over.wait(2.0)

    over, somebody = threading.Event(), threading.Thread(target=jog)
    somebody.start()
    try:
        code, out, err = check(folder, "--json", "--workers", "1")
    finally:
        over.set()
        somebody.join()
    assert code == 1
    assert out == ""
    assert "nothing was sent from here" in err


@pytest.mark.slow
def test_a_limit_is_never_weakened_before_an_arm_on_a_wire(lab):
    folder, _ = lab
    code, _, err = check(folder, "--mutate")
    assert code == 2
    assert "expected a twin's rig" in err


N_TRIES = 4


@pytest.mark.slow
def test_the_probe_list_moves_the_virtual_arm_as_it_says_by_the_twins_own_joints(lab):
    folder, controller = lab
    chain = ToolChain(load_arm("ur5e"))
    for _ in range(N_TRIES):
        machine, begun_s = Overbooked(), time.monotonic()
        code, out, err = check(folder, "--probe", "--json", "--out", "kept")
        report = json.loads(out) if out else {"ended": err, "results": ()}  # an arm that was not taken moved nothing
        if code == 0 or machine.share() < OVERBOOKED_SHARE:
            break
    else:
        pytest.skip(f"this machine is too busy to hold an arm: {report['ended']}")
    assert code == 0, ([row for row in report["results"] if not row["ok"]], report["ended"], err)
    assert report["n_done"] == report["n_probes"] == 7
    assert report["armed_by"] == "simulated operator"
    rows = {row["name"]: row for row in report["results"]}
    assert 20.0 <= rows["wall_reached_mm"]["value"] <= 30.0
    assert "stale_intent" in rows["silence_latched"]["details"]["by"]
    trace = read_trace(folder / "trace", since_s=begun_s)
    q, qd = trace[:, 3:9], trace[:, 9:15]
    tool_m = np.array([chain.tcp(tuple(row)) for row in q.tolist()])
    assert np.abs(tool_m - tool_m[0]).max() < 0.05
    speeds = np.linalg.norm(np.diff(tool_m[::5], axis=0), axis=1) / 0.01
    assert speeds.max() < 0.055
    assert np.abs(qd[-100:]).max() < 5e-3
    y = tool_m[:, 1] - tool_m[0, 1]
    assert min(abs(y.min()), y.max()) == pytest.approx(rows["wall_reached_mm"]["value"] * 1e-3, abs=1e-3)
    assert json.loads((folder / "kept/probe.json").read_text()) == report
    assert controller.fault("truth")["runtime"] == "STOPPED"


@pytest.mark.slow
def test_an_arm_with_a_program_on_it_is_not_watched_for_standing(tmp_path):
    host = own_address()
    make_lab(tmp_path, host)
    setup = Setup(
        host=host, scenario=str(tmp_path / "small.yaml"), bus=f"tcp/{host}:7447", cell="ur_box",
        script="def waits():\n  while True:\n    sync()\n  end\nend\n",
    )  # fmt: skip
    with ControllerProcess(setup) as controller:
        code, out, err = check(tmp_path, *SHORT)
        assert code == 1
        assert out == ""
        assert "expected no program on the arm" in err
        assert has_run_a_program(controller)
        assert controller.fault("truth")["runtime"] == "PLAYING"


@pytest.mark.slow
def test_a_person_is_asked_before_each_move_and_may_end_the_list(tmp_path):
    host = own_address()
    rig = make_lab(tmp_path, host, operator="robot.person:PersonOperator", reset="person", perception=None)
    with controller_of(tmp_path, host, cell="ur_box") as controller:
        person = Session("check", "--rig", str(rig), "--scenario", str(tmp_path / "small.yaml"), "--probe")
        try:
            person.until(r"stand clear, hand on the emergency stop; then Enter", 90.0)
            person.type(b"\n")
            person.until(r"the code is \d{4}: type it within 10 s, then Enter", 30.0)
            person.type(re.findall(r"the code is (\d{4})", person.text)[-1].encode() + b"\n")
            person.until(r"1 of 7, the hand turns .*Enter moves, n ends the list", 30.0)
            before = controller.fault("truth")["q_rad"]
            time.sleep(1.0)
            assert controller.fault("truth")["q_rad"] == pytest.approx(before, abs=1e-3)
            person.type(b"\n")
            person.until(r"2 of 7, the tool moves .*Enter moves, n ends the list", 60.0)
            person.type(b"n\n")
            assert person.end() == 1, person.text[-3000:]
        finally:
            person.close()
        assert "The list ended early: ended by the person who attends" in " ".join(person.text.split())
        assert controller.fault("truth")["runtime"] == "STOPPED"
