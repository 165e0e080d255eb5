"""A rig of which a person starts a part, in a terminal of its own: `autotelic up` says which, and sees to the rest."""

import json
import os
import signal
import time

import pytest

from tests.support.small_lab import controller_of, make_lab, start

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

HOST = "127.0.0.84"
RIG = ("--rig", "{rig}", "--scenario", "{scenario}")
NODES = [
    {"name": "hub", "kind": "hub", "command": ["node", "hub", *RIG]},
    {"name": "recorder", "command": ["node", "recorder", *RIG, "--out", "{out}/sessions"]},
    {"name": "robot", "kind": "robot", "is_by_hand": True, "command": ["node", "robot", *RIG]},
    {"name": "learning", "kind": "job", "is_by_hand": True, "command": ["learn", *RIG, "--out", "{out}/run"]},
]


def until(is_so, timeout_s=60.0):
    end_s = time.monotonic() + timeout_s
    while not is_so():
        assert time.monotonic() < end_s
        time.sleep(0.05)


def test_what_a_person_starts_is_named_heard_and_stopped_but_neither_started_nor_killed(tmp_path):
    make_lab(tmp_path, HOST, reset="person", operator="robot.person:PersonOperator", nodes=NODES)
    log = tmp_path / "up/logs/supervisor.log"

    def said(what):
        return log.exists() and what in log.read_text()

    with (
        controller_of(tmp_path, HOST, bus=""),
        start(tmp_path, "up", "rig.yaml", "--scenario", "small.yaml", "--out", "up", "--json") as up,
    ):
        until(lambda: said("learning: in a terminal of its own, start: autotelic learn --rig rig.yaml"))
        assert said("robot: in a terminal of its own, start: autotelic node robot --rig rig.yaml")
        with start(tmp_path, "node", "robot", "--rig", "rig.yaml", "--scenario", "small.yaml") as robot:
            time.sleep(3.0)
            os.kill(robot.pid, signal.SIGSTOP)
            until(lambda: said("robot: silent for 1.5 s: look at its terminal"))
            os.kill(robot.pid, signal.SIGCONT)
            until(lambda: said("robot: heard again"))
            up.send_signal(signal.SIGINT)
            out, err = up.communicate(timeout=60)
            assert robot.poll() is None, "it goes on: it is not the supervisor's"
            robot.send_signal(signal.SIGINT)
            robot.communicate(timeout=30)
    summary = json.loads(out)
    assert summary["exit_code"] == 3, err
    assert summary["stop_last_ms"] is not None, "the arm was stopped at the end, whoever started who holds it"
    starts = {node["name"]: node["n_starts"] for node in summary["nodes"]}
    assert starts == {"hub": 1, "recorder": 1, "robot": 0, "learning": 0}
