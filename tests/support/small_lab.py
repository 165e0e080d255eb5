"""A small lab on an address of its own: two buttons, a lidded box, the virtual controller and rig files for it."""

import os
import subprocess
import sys
from pathlib import Path

import yaml

from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup

__all__ = ["RULES", "SCENARIO", "SERIAL", "autotelic", "children_of", "controller_of", "make_lab", "start"]

ROOT = Path(__file__).parents[2]
SERIAL = "20215501234"

SCENARIO = """\
name: small
buttons:
  - {name: left_button, position_m: [0.30, -0.12], spread_m: [0.02, 0.02], colour: [0.9, 0.5, 0.1],
     input: 0, lamp_output: 0}
  - {name: right_button, position_m: [0.30, 0.12], spread_m: [0.02, 0.02], colour: [0.1, 0.6, 0.3],
     input: 1, lamp_output: 1}
boxes:
  - {name: chest, position_m: [0.54, 0.0], spread_m: [0.02, 0.02], colour: [0.8, 0.4, 0.4], lid: {output: 2},
     presence_input: 2}
cylinders:
  - {name: red_cylinder, position_m: [0.55, 0.24], spread_m: [0.02, 0.02], colour: [0.8, 0.1, 0.1], receptacle: chest}
distances: [left_button, right_button, chest, red_cylinder, table]
goals:
  - {name: left_pressed, kind: pressed, object: left_button}
  - {name: right_pressed, kind: pressed, object: right_button}
schedule:
  - {from_epoch: 0, rules: ./small_rules.yaml}
"""
RULES = """\
name: small_rules
rules:
  - {output: chest, when: [{input: left_button, is_on: true}]}
"""
FAST = """\
name: fast
experiment: {epochs: 3, trials: 1, steps: 6, evaluate_every: 50, test_epochs: 1, checkpoint_every: 1}
"""


def make_lab(folder, host, *, cell=None, rig="virtual_lab", **changes):
    """Write scenario, rules, learner, cell and a shipped rig, changed, into a folder, and return the rig's file."""
    for name, text in (("small", SCENARIO), ("small_rules", RULES), ("fast", FAST)):
        (folder / f"{name}.yaml").write_text(text)
    tree = yaml.safe_load((ROOT / f"config/rigs/{rig}.yaml").read_text())
    tree |= {"name": "small_lab", "address": host, "bus": f"tcp/{host}:7447", **changes}
    if cell is not None:
        (folder / "cell.yaml").write_text(cell)
        tree["cell"] = "./cell.yaml"
    path = folder / "rig.yaml"
    path.write_text(yaml.safe_dump(tree))
    return path


def controller_of(folder, host, **settings):
    """Return the virtual controller of a lab, not yet started."""
    chosen = {"bus": f"tcp/{host}:7447", "scenario": str(folder / "small.yaml")} | settings
    return ControllerProcess(Setup(host=host, **chosen))


def start(folder, *arguments, **popen):
    """Start the command in a process group of its own, so that a signal can reach all of it as Ctrl-C does."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
    command = [sys.executable, "-c", "from robot.cli import main; main()", *map(str, arguments)]
    return subprocess.Popen(
        command, cwd=folder, env=environment, start_new_session=True, text=True, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE, **popen,
    )  # fmt: skip


def autotelic(folder, *arguments, timeout_s=60, said=None):
    """Run the command to its end and return code, output and errors."""
    process = start(folder, *arguments, stdin=subprocess.PIPE)
    out, err = process.communicate(said, timeout=timeout_s)
    return process.returncode, out, err


def children_of(pid):
    """Return the numbers of a process's children, whatever group they are in."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            if int(stat.read_text().rsplit(")", 1)[1].split()[1]) == pid:
                found.append(int(stat.parent.name))
        except (OSError, ValueError):
            continue
    return found
