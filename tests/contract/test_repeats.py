"""What the suite does with a failure while the machine stalls: it is repeated, if there is a world to repeat it on."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.contract_rigs import open_world

ROOT = Path(__file__).parents[2]
STALLING = """
from itertools import count

from tests.contract import conftest as suite
from tests.contract.conftest import *  # noqa: F403

now = count()
suite.waited_s = lambda: float(next(now))


class Shut:
    is_lock_step = False

    def __init__(self, *_):
        raise OSError("its port is taken")


class Open:
    is_lock_step, n_renewed = False, 0

    def __init__(self, *_):
        self.resolved = None

    def renew(self):
        Open.n_renewed += 1

    def close(self):
        pass


suite.WORLDS["virtual_lab"] = {kind}
"""


ONCE = "def test_once(world):\n    assert world.n_renewed == 1\n"
EVERY_OTHER = "runs = []\ndef test_once(world):\n    runs.append(1)\n    assert len(runs) % 2 == 0\n"


@pytest.mark.parametrize(
    ("kind", "body", "told"),
    [("Shut", ONCE, "OSError: its port is taken"), ("Open", ONCE, "1 passed"), ("Open", EVERY_OTHER, "1 failed")],
    ids=["shut", "open", "every_other"],
)
def test_a_failure_is_repeated_where_a_world_stands_and_must_then_pass_twice_running(tmp_path, kind, body, told):
    (tmp_path / "conftest.py").write_text(STALLING.replace("{kind}", kind), encoding="utf-8")
    (tmp_path / "test_once.py").write_text(body, encoding="utf-8")
    command = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", "virtual_lab", "--rootdir", str(tmp_path), "."]
    said = subprocess.run(
        [sys.executable, *command],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    ).stdout
    assert told in said
    assert "KeyError" not in said


@pytest.mark.slow
@pytest.mark.realtime
def test_a_plant_that_lost_its_link_is_renewed_although_a_failure_that_is_told_still_holds_its_clients():
    """A traceback's frames do: their clients went on, and the next to engage found its registers in use."""
    pytest.importorskip("rtde_control")
    world = open_world("virtual_lab")
    try:
        plant = world.plant()
        plant.arm.engage()
        held = plant.arm._command.control, plant.arm._command.outputs
        assert all(held)
        plant.arm.links.is_lost = True
        world.renew()
        again = world.plant()
        assert again is not plant
        again.arm.engage()
        assert again.arm.stop()
    finally:
        world.close()
