"""docs/two-machines.md is run as it stands between two network namespaces: from `keys init` to motion."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sim_twin.controller.process import ask_fault
from tests.support.netns import Cable, inside, why_not

pytestmark = [pytest.mark.realtime, pytest.mark.slow]

ROOT = Path(__file__).parents[4]
PAGE = ROOT / "docs" / "two-machines.md"
ARMS, LEARNERS = "192.168.1.5", "192.168.1.6"
ARM = "127.0.0.2"
BLOCK = re.compile(
    r"```sh\n# on the (arm|learner)'s machine(?:, and (leave it running|it is refused))?\n(.*?)```", re.DOTALL
)


def blocks():
    """Return the page's blocks: whose machine, what is said of it, and what is to be pasted."""
    found = BLOCK.findall(PAGE.read_text())
    assert len(found) == PAGE.read_text().count("```sh"), "each block says where"
    return found


class Machine:
    """A namespace, a folder and the `autotelic` command."""

    def __init__(self, cable, name, folder):
        self._cable, self._name, self.folder = cable, name, folder
        folder.mkdir(exist_ok=True)
        tools = folder.parent / "bin"
        tools.mkdir(exist_ok=True)
        tool = tools / "autotelic"
        tool.write_text(f"#!/bin/sh\nexec {sys.executable} -c 'from robot.cli import main; main()' \"$@\"\n")
        tool.chmod(0o755)
        self._environment = os.environ | {
            "PATH": f"{tools}:{os.environ['PATH']}", "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1",
        }  # fmt: skip

    def start(self, text):
        words = self._cable.command(self._name, "bash", "-e", "-c", text)
        return subprocess.Popen(
            words, cwd=self.folder, env=self._environment, text=True, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, start_new_session=True,
        )  # fmt: skip

    def paste(self, text, timeout_s=180):
        process = self.start(text)
        try:
            out, _ = process.communicate(timeout=timeout_s)
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.communicate()
        return process.returncode, out


def joints(cable):
    with inside(cable.a):
        return ask_fault(ARM, "truth")["q_rad"]


def until_up(folder, process):
    log, end_s = folder / "runs/up-virtual_lab/logs/supervisor.log", time.monotonic() + 120
    while not log.exists() or "robot: started as" not in log.read_text():
        assert time.monotonic() < end_s
        assert process.poll() is None, process.communicate()[0]
        time.sleep(0.2)


def test_the_page_goes_from_keys_init_to_motion_and_refuses_who_has_no_certificate(tmp_path):
    why = why_not()
    if why is not None:
        pytest.skip(why)
    with Cable(ARMS, LEARNERS) as cable:
        arms = Machine(cable, cable.a, tmp_path / "arm")
        learners = Machine(cable, cable.b, arms.folder / "for-the-learner")
        shutil.rmtree(learners.folder)
        running = None
        try:
            for whose, said, text in blocks():
                if said == "leave it running":
                    running = arms.start(text)
                    until_up(arms.folder, running)
                    before = joints(cable)
                    continue
                code, out = (arms if whose == "arm" else learners).paste(text)
                assert (code != 0) is (said == "it is refused"), f"{text}\n{out}"
                if "autotelic learn" in text and not said:
                    moved = max(abs(a - b) for a, b in zip(joints(cable), before, strict=True))
                    assert moved > 0.01, out
                    assert "robot (robot," in out
                    still = joints(cable)
            assert "keys issue" in out
            assert joints(cable) == pytest.approx(still, abs=2e-3)
        finally:
            if running is not None:
                os.killpg(running.pid, signal.SIGINT)
                said_at_the_end, _ = running.communicate(timeout=90)
    assert "its stop was not confirmed" not in said_at_the_end


def test_every_block_of_the_page_is_run():
    assert [whose for whose, _, _ in blocks()] == ["arm", "arm", "arm", "learner", "learner", "learner"]
