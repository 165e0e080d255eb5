"""A virtual robot without ports or wall time, and a client that writes its registers by hand."""

import numpy as np

from sim_twin.controller.robot import VirtualRobot, make_world
from sim_twin.controller.states import RuntimeState

__all__ = ["FOREVER", "RegisterClient", "ended", "lines", "make_robot", "run", "started", "state_of", "swept_rad"]

READY, DONE, FREE = 1, 2, 0
FOREVER = "def waits():\n  while True:\n    sync()\n  end\nend\n"


def make_robot(**settings):
    return VirtualRobot(make_world(), **settings)


def run(robot, n=1, until=None):
    """Step some slices, or until something holds; return how many."""
    for k in range(n):
        if until is not None and until():
            return k
        robot.step()
    assert until is None or until(), list(robot.machine.journal.lines)[-5:]
    return n


def started(text, **settings):
    """Return a robot on which the program plays."""
    robot = make_robot(**settings)
    robot.submit_script(text)
    run(robot, 5, lambda: state_of(robot) is RuntimeState.PLAYING)
    return robot


def lines(robot):
    """Return the log's lines."""
    return [text for _, text in robot.machine.journal.lines]


def state_of(robot):
    """Return what its program does."""
    return robot.machine.modes.runtime


def ended(robot, n=2000):
    """Step until no program runs; return how many slices that took."""
    return run(robot, n, lambda: state_of(robot) is RuntimeState.STOPPED)


class RegisterClient:
    """Commands the client's script through registers, as the genuine client does, from a register on."""

    def __init__(self, robot, first=0):
        self.robot, self.first = robot, first
        self.trace = []

    def say(self, command, doubles=(), ints=()):
        writer, first = self.robot.machine.writer, self.first
        for i, value in enumerate(doubles):
            writer(f"input_double_register_{first + i}")(float(value))
        for i, value in enumerate(ints):
            writer(f"input_int_register_{first + 1 + i}")(value)
        writer(f"input_int_register_{first}")(command)

    def state(self):
        return self.robot.machine.registers.outputs.ints[self.first]

    def step(self, n=1):
        for _ in range(n):
            self.robot.step()
            self.trace.append(self.robot.machine.world.data.qpos[:6].copy())

    def await_state(self, state, n=3000):
        for _ in range(n):
            if self.state() == state:
                return
            self.step()
        lines = list(self.robot.machine.journal.lines)[-5:]
        raise AssertionError(f"state {state} did not come: {lines}")

    def command(self, command, doubles=(), ints=()):
        self.await_state(READY)
        self.say(command, doubles, ints)
        self.await_state(DONE)
        self.say(FREE)
        self.await_state(READY)

    def start(self, text):
        self.robot.submit_script(text)
        run(self.robot, 500, lambda: self.robot.machine.modes.runtime is RuntimeState.PLAYING)
        self.await_state(READY)

    def joints(self):
        return np.array(self.trace)


def swept_rad(robot, n):
    """Step and return the greatest way of any joint from where it is, at any time."""
    q = robot.machine.world.data.qpos
    start, furthest = q[:6].copy(), 0.0
    for _ in range(n):
        robot.step()
        furthest = max(furthest, float(np.abs(q[:6] - start).max()))
    return furthest
