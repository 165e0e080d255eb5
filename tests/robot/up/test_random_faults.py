"""Faults on purpose: drawn by a seed, at even times, what is frozen goes on, and nothing of it at a real arm."""

import json
import os
import signal

import numpy as np
import pytest

from config.loader import load_rig
from robot.errors import RobotConfigError
from robot.up.faults import FROZEN_S, RandomFaults, What, check_faults
from tests.support.small_lab import make_lab, start

NODES = ("twin", "robot", "learning")
HOST = "127.0.0.84"
ENDLESS = """\
name: endless
experiment: {epochs: 100000, trials: 1, steps: 40, evaluate_every: 50000, test_epochs: 1, checkpoint_every: 1,
  void_limit: 500}
"""


def drawn(seed, seconds, every_s=20.0):
    faults = RandomFaults(NODES, every_s=every_s, rng=np.random.default_rng(seed))
    return [(t, fault) for t in np.arange(0.0, seconds, 0.5).tolist() for fault in faults.due(t)]


def test_a_fault_comes_every_so_often_from_one_interval_after_the_beginning():
    assert [t for t, fault in drawn(1, 201.0) if fault.is_begin] == [20.0 * k for k in range(1, 11)]


def test_the_same_seed_draws_the_same_and_every_fault_befalls_every_process():
    assert drawn(3, 2000.0) == drawn(3, 2000.0) != drawn(4, 2000.0)
    begun = {(fault.node, fault.what) for _, fault in drawn(3, 8000.0) if fault.is_begin}
    assert begun == {(node, what) for node in NODES for what in What}


def test_whoever_is_frozen_goes_on_when_its_time_is_over():
    found = drawn(5, 4000.0)
    frozen = [(t, fault) for t, fault in found if fault.number is signal.SIGSTOP]
    goes_on = [(t, fault.node) for t, fault in found if fault.number is signal.SIGCONT]
    assert len(frozen) > 50
    assert goes_on == [(t + FROZEN_S[fault.what], fault.node) for t, fault in frozen]


@pytest.mark.parametrize(("rig", "is_refused"), [("virtual_lab", False), ("lab", True), ("twin", True)])
def test_only_a_virtual_plant_s_processes_are_faulted(rig, is_refused):
    if is_refused:
        with pytest.raises(RobotConfigError, match="expected a virtual plant"):
            check_faults(load_rig(rig))
    else:
        check_faults(load_rig(rig))


SOAK_S = float(os.environ.get("AUTOTELIC_SOAK_S", "600"))


@pytest.mark.slow
@pytest.mark.realtime
@pytest.mark.timeout(SOAK_S + 400.0)
def test_a_run_bears_a_random_fault_every_twenty_seconds_and_goes_on(tmp_path):
    """AUTOTELIC_SOAK_S says for how long; an hour is what is asked, ten minutes are run by itself."""
    make_lab(tmp_path, HOST, cell=None, max_latches=10_000)  # a fault latches, and so many would end a learner
    (tmp_path / "endless.yaml").write_text(ENDLESS)
    process = start(
        tmp_path, "up", "rig.yaml", "--scenario", "small.yaml", "--out", "up", "--json", "--fault-every", "20",
        "--seconds", SOAK_S, "--seed", "7", "--", "--preset", "endless.yaml",
    )  # fmt: skip
    out, err = process.communicate(timeout=SOAK_S + 300.0)
    assert process.returncode == 3, err[-2000:]
    summary = json.loads(out)
    happened = [event["what"] for event in summary["events"]]
    assert sum(what.startswith("on purpose") for what in happened) >= SOAK_S / 40.0
    assert not any("given up" in what for what in happened)
    epochs = len((tmp_path / "up/run/goals.csv").read_text().splitlines()) - 1
    assert epochs >= SOAK_S / 60.0, "it goes on learning"
    with open("soak.txt", "a") if "AUTOTELIC_SOAK_S" in os.environ else open(os.devnull, "w") as told:
        told.write(json.dumps({"epochs": epochs, "seconds": SOAK_S, "nodes": summary["nodes"]}) + "\n")
