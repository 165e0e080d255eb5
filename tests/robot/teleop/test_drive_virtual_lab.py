"""A scripted drive through the genuine client and the virtual controller, in wall time."""

import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest
import yaml

from tests.support.small_lab import controller_of, make_lab

HOST = "127.0.0.68"
STEPS = [
    {"for_s": 1.0, "linear": [0.0, 1.0, 0.0]},
    {"for_s": 1.0, "is_held": False},
    {"for_s": 0.6, "linear": [0.0, -1.0, 0.0], "grip": "close"},
]


@pytest.mark.slow
def test_a_scripted_drive_moves_the_virtual_arm_and_leaves_it_at_rest(tmp_path):
    rig = make_lab(tmp_path, HOST)
    (tmp_path / "drive.yaml").write_text(yaml.safe_dump({"steps": STEPS}))
    with controller_of(tmp_path, HOST) as controller:
        done = subprocess.run(
            [
                Path(sys.executable).parent / "autotelic", "teleop", "--rig", rig, "--scenario", "small.yaml",
                "--device", "script:drive.yaml", "--no-view", "--json", "--speed", "0.5",
            ],
            cwd=tmp_path, capture_output=True, text=True, timeout=90,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        end = msgspec.json.decode(done.stdout)
        assert end["is_at_rest"]
        assert end["n_latches"] == 0
        assert end["n_steps"] >= 130
        truth = controller.fault("truth")
        assert np.abs(truth["qd_rad_s"]).max() < 5e-3
        assert truth["runtime"] == "STOPPED"
