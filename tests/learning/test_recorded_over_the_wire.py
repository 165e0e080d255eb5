"""A run on the rig virtual_lab, in wall time, is recorded and lived through again to the same learner."""

import json
from itertools import pairwise
from statistics import median

import pytest

from learning.run_folder import RunFolder
from robot.bus.topics import ARM_STATE, REQUESTED, SENT, VERDICT
from robot.recording.session_file import SessionFile
from tests.support.small_lab import autotelic, controller_of, make_lab

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

HOST = "127.0.0.66"


def test_a_run_over_the_wire_is_recorded_and_replayed_to_the_same_learner(tmp_path):
    make_lab(tmp_path, HOST)
    with controller_of(tmp_path, HOST):
        asked = ("learn", "--rig", "rig.yaml", "--scenario", "small.yaml", "--preset", "fast.yaml", "--out", "run")
        code, _, said = autotelic(tmp_path, *asked, "--record", timeout_s=240)
        assert code == 0, said
        (path,) = (tmp_path / "run").glob("*.mcap")
        code, told, said = autotelic(tmp_path, "session", "replay", path, "--to", "arm", "--json", timeout_s=240)
        replayed = json.loads(told)
        assert (code, replayed["is_same"]) == (0, True), said
        assert replayed["n_steps"] > 10
        assert replayed["joint_error_rad"] < 0.1, told
    (path,) = (tmp_path / "run").glob("*.mcap")
    with SessionFile(path) as session:
        about = session.about
        stamps = [message.stamp_ns for _, _, message in session.messages(ARM_STATE)]
        n_asked, n_sent, n_judged = (sum(1 for _ in session.raw([t.name])) for t in (REQUESTED, SENT, VERDICT))
    assert (about["clock"], about["plant"]) == ("host", "virtual")
    usual_ns = median(b - a for a, b in pairwise(stamps))
    assert usual_ns == pytest.approx(2e6, abs=4e5), "every tick of 500 Hz is in it"
    assert len(stamps) > 100
    assert n_asked == n_sent == n_judged > 100
    code, told, said = autotelic(tmp_path, "learn", "--replay", path, "--json", timeout_s=240)
    assert code == 0, told + said
    assert json.loads(told)["n_done"] == RunFolder(tmp_path / "run").checkpoints.newest()[0]["n_done"]
    code, _, said = autotelic(tmp_path, "session", "replay", path, "--to", "twin")
    assert (code, ("is on a wire" in said and "nothing moves" in said)) == (2, True), said
