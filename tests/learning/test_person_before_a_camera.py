"""A person lays the table out, and a rendered camera judges it: the rig `lab`, at a virtual arm, a drawn table."""

import os
import re
import signal
import subprocess

import pytest

from config.loader import load_rig
from tests.support.person_at_arm import attended
from tests.support.small_lab import controller_of, make_lab, start

pytestmark = [pytest.mark.realtime, pytest.mark.slow, pytest.mark.gl]

HOST = "127.0.0.66"
PERSON = "robot.person:PersonOperator"
IN_PLACE = "everything that can be seen is in place; red_cylinder is taken on your word to be in red_box"


def test_what_a_person_laid_out_is_judged_by_what_the_camera_sees(tmp_path):
    """How far an epoch gets after that depends on how fast this machine draws: a percept may be 150 ms old."""
    parked_rad = list(load_rig("lab").parked_rad)
    make_lab(tmp_path, HOST, rig="virtual_lab_camera", reset="person", operator=PERSON, parked_rad=parked_rad)
    node = ("--rig", "rig.yaml", "--scenario", "paper")
    with (
        controller_of(tmp_path, HOST, scenario="paper") as controller,
        attended(tmp_path, controller, scenario="paper", kinds=("camera", "perception")) as (person, _),
        start(tmp_path, "learn", *node, "--out", "run", "--epochs", "1", stdin=subprocess.PIPE) as learner,
    ):
        learner.stdin.write("\n")
        learner.stdin.flush()
        person.await_said(IN_PLACE, timeout_s=240)
        os.killpg(learner.pid, signal.SIGKILL)
    assert person.asked, "".join(person.said)
    off = re.findall(r"not in place: (\w+): (\d+) mm off", "".join(person.said))
    assert {"orange_button", "blue_button", "red_box"} <= {name for name, _ in off}
    assert all(int(mm) > 10 for _, mm in off)
