"""A person lays the table out, and a rendered camera judges it: the rig `lab`, at a virtual arm, a drawn table."""

import re

import pytest

from config.loader import load_rig
from tests.support.person_at_arm import attended
from tests.support.small_lab import autotelic, controller_of, make_lab

pytestmark = [pytest.mark.realtime, pytest.mark.slow, pytest.mark.gl]

HOST = "127.0.0.66"


def test_what_a_person_laid_out_is_judged_by_what_the_camera_sees(tmp_path):
    parked_rad = load_rig("lab").parked_rad
    make_lab(
        tmp_path, HOST, rig="virtual_lab_camera", reset="person", operator="robot.person:PersonOperator",
        parked_rad=list(parked_rad),
    )  # fmt: skip
    (tmp_path / "fast.yaml").write_text(FAST)
    with (
        controller_of(tmp_path, HOST, scenario="paper") as controller,
        attended(tmp_path, controller, scenario="paper", kinds=("camera", "perception")) as (person, _),
    ):
        code, _, said = autotelic(
            tmp_path, "learn", "--rig", "rig.yaml", "--scenario", "paper", "--preset", "fast.yaml", "--out", "run",
            "--epochs", "1", timeout_s=400, said="\n",
        )  # fmt: skip
    text = "".join(person.said)
    assert code == 0, said + text
    assert re.search(r"not in place: \w+: \d+ mm off", text), "the first table was drawn for another epoch"
    assert "everything that can be seen is in place; red_cylinder is taken on your word to be in red_box" in text


FAST = """\
name: fast
experiment: {epochs: 1, trials: 1, steps: 6, evaluate_every: 50, test_epochs: 1, checkpoint_every: 1}
"""
