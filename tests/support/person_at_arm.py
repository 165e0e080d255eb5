"""A person at a robot node's terminal, who presses Enter, types codes, and lays the table out when told what is off."""

import re
import signal
import subprocess
import time
from contextlib import ExitStack, contextmanager
from threading import Thread

import numpy as np

from config.loader import load_arm, load_rig
from tests.support.small_lab import start

__all__ = ["AtTheArm", "attended"]


class AtTheArm:
    """Presses Enter, types what is shown, and lays the table out when told what is off."""

    def __init__(self, folder, controller):
        self.folder, self.controller = folder, controller
        self.said, self.parked_rad = [], []
        self.parked = np.array(load_rig(folder / "rig.yaml").parked_rad or load_arm("ur5e").home_rad)
        self.asked = None

    def answer(self, line):
        """Return what is typed at a line, None at one that asks nothing."""
        self.said.append(line)
        code = re.search(r"the code is (\d+)|: type (\d\d), then Enter", line)
        if code:
            return code[1] or code[2]
        if "Enter" not in line:
            return None
        asked = re.search(r"epoch (\d+), seed (\d+), as in (\S+);", line)
        if asked:
            truth = self.controller.fault("truth")
            assert truth["runtime"] == "STOPPED", "a person reaches in: nobody may be in command"
            self.parked_rad.append(np.abs(np.array(truth["q_rad"]) - self.parked).max())
            assert (self.folder / asked[3]).read_bytes()[:4] == b"\x89PNG"
            self.asked = asked
        elif "put right" in line:
            self.controller.fault("lay_out", seed=int(self.asked[2]), epoch=int(self.asked[1]))
        return ""

    def await_said(self, words, *, timeout_s=90.0):
        """Wait until it was said at the terminal."""
        end_s = time.monotonic() + timeout_s
        while not any(words in line for line in self.said):
            assert time.monotonic() < end_s, "".join(self.said)
            time.sleep(0.02)

    def attend(self, process):
        """Answer whatever a process asks, until it ends."""
        for line in process.stderr:
            typed = self.answer(line)
            if typed is not None:
                process.stdin.write(f"{typed}\n")
                process.stdin.flush()


@contextmanager
def attended(folder, controller, *, scenario="small.yaml", kinds=("perception",)):
    """Run the nodes of a lab, with a person at the robot node's terminal."""
    node = ("--rig", "rig.yaml", "--scenario", scenario)
    person = AtTheArm(folder, controller)
    with ExitStack() as stack:
        others = [stack.enter_context(start(folder, "node", kind, *node, stdin=subprocess.DEVNULL)) for kind in kinds]
        robot = stack.enter_context(start(folder, "node", "robot", *node, stdin=subprocess.PIPE))
        attends = Thread(target=person.attend, args=(robot,))
        attends.start()
        try:
            person.await_said("waits for a source")
            yield person, robot
        finally:
            for process in (robot, *others):
                process.send_signal(signal.SIGINT)
            for process in (robot, *others):
                process.wait(timeout=20)
            attends.join()
