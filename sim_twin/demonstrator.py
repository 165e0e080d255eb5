"""A scripted person with a stick: shows goals on a driven twin, with an unsteady hand, by ways that are not straight.

It knows the rules, as somebody who shows how does; what comes of it is only in what is recorded. Everything is drawn
from its seed. It drives as a stick does: a velocity for 20 ms, the hand opened and closed by a button.
"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from config.resolved import Resolved
from config.scenario import Goal, GoalKind
from robot.messages import Grip, Percept, StepResult, Twist, Vec3
from robot.oracle import rules_oracle
from robot.recording.messages import Purpose
from robot.recording.recording import Recording
from robot.rigs import build_operator, build_station
from robot.station import Station

__all__ = ["Demonstrator", "record_demonstrations"]

STEP_S = 0.02
FULL_M_S, EASE_PER_S = 0.22, 4.0
NEAR_M, OVER_M = 0.008, 0.012
SHAKE = 0.12
"""Noise of the stick, as a share of full."""
DETOURS = 0.4
"""Share of ways that lead by somewhere else first."""
IDLE = 0.25
"""Share of ways before which nothing needed is pressed first: people show off."""
MOST_STEPS = 600
PUSH_M_S = 0.05
FIRST_TABLE = 1000


def record_demonstrations(path: Path, resolved: Resolved, *, n_each: int, seed: int) -> int:
    """Record so many demonstrations of every goal, a table each, and return how many went as they should."""
    recording = Recording(path, resolved, purpose=Purpose.DRIVE, seed=seed)
    local = build_station(resolved, is_driven=True, tap=recording.ticks)
    operator = build_operator(resolved.rig)
    assert operator is not None, "a twin's rig names one"
    try:
        operator.arm_once(local)
        person = Demonstrator(recording.drive(local), resolved, seed=seed)
        n_goals = len(resolved.scenario.goals)
        tables = [(k * n_goals + goal, goal) for k in range(n_each) for goal in range(n_goals)]
        return sum(person.show(goal, seed=FIRST_TABLE + table, epoch=0) for table, goal in tables)
    finally:
        local.close()
        recording.close()


class Demonstrator:
    """Shows goals on a station with a hand that does as it is asked.

    Args:
        station: driven.
        resolved: of the twin; its rules are known here.
        seed: of all that is drawn.
    """

    def __init__(self, station: Station, resolved: Resolved, *, seed: int) -> None:
        self._station, self._scenario = station, resolved.scenario
        self._allowed = rules_oracle(resolved)
        self._rng = np.random.default_rng(seed)
        self._travel_m = station.spec.table_height_m + station.spec.heights_m[1]
        self._low_m = station.spec.table_height_m + station.spec.heights_m[0]
        self._grip: Grip | None = None
        self._shake = np.zeros(3)
        self.n_steps = 0

    def show(self, goal: int, *, seed: int, epoch: int) -> bool:
        """Lay a table out and bring a goal about on it, with all that it needs; return whether it went as it should."""
        self._percept = self._station.reset(seed=seed, epoch=epoch)
        self._grip = None
        goals = self._scenario.goals
        extra = [i for i, g in enumerate(goals) if g.kind is GoalKind.PRESSED and i != goal]
        if self._rng.random() < IDLE:
            self._bring_about(goals[int(self._rng.choice(extra))])
        return all(self._bring_about(goals[step]) for step in self._way_to(goal, epoch))

    def _way_to(self, goal: int, epoch: int) -> tuple[int, ...]:
        """Return the shortest order of goals that ends with the wanted one, by the rules."""
        n = len(self._scenario.goals)
        frontier: list[tuple[tuple[int, ...], tuple[bool, ...]]] = [((), (False,) * n)]
        while frontier:
            way, state = frontier.pop(0)
            if self._allowed(goal, state, epoch):
                return (*way, goal)
            open_now = [g for g in range(n) if not state[g] and self._allowed(g, state, epoch)]
            frontier += [((*way, g), (*state[:g], True, *state[g + 1 :])) for g in open_now]
        raise AssertionError(f"expected a way to goal {goal}, there is none")

    def _bring_about(self, goal: Goal) -> bool:
        if self._rng.random() < DETOURS:
            low, high = self._station.spec.workspace_m
            x, y = (float(self._rng.uniform(a + 0.05, b - 0.05)) for a, b in zip(low[:2], high[:2], strict=True))
            self._go((x, y, self._travel_m), within_m=0.05)
        name = goal.box if goal.kind is GoalKind.IN_BOX and goal.box else goal.object
        if goal.kind is GoalKind.GRABBED:
            self._grip = Grip.OPEN
        x, y, _ = self._where(name)
        if not self._go((x, y, self._travel_m), within_m=OVER_M):
            return False
        match goal.kind:
            case GoalKind.PRESSED:
                is_done = self._sink(lambda: self._is_lit(goal.object), n_after=4)
            case GoalKind.GRABBED:
                is_done = self._take(goal.object)
            case GoalKind.IN_BOX:
                is_done = self._sink(lambda: self._percept.tcp_position_m[2] < self._low_m + 0.05, n_after=1)
                self._grip = Grip.OPEN
                self._wait(30)
        x, y, _ = self._percept.tcp_position_m
        return self._go((x, y, self._travel_m), within_m=0.03) and is_done

    def _take(self, name: str) -> bool:
        x, y, z = self._where(name)
        if not self._go((x, y, z), within_m=NEAR_M):
            return False
        self._grip = Grip.CLOSE
        for _ in range(100):
            self._step((0.0, 0.0, 0.0))
            if self._percept.grip.has_object:
                return True
        return False

    def _sink(self, is_enough: Callable[[], bool], *, n_after: int) -> bool:
        for _ in range(MOST_STEPS):
            self._step((0.0, 0.0, -PUSH_M_S if self._percept.tcp_position_m[2] < 0.12 else -FULL_M_S * 0.6))
            if is_enough():
                self._wait(n_after)
                return True
        return False

    def _go(self, to_m: Vec3, *, within_m: float) -> bool:
        for _ in range(MOST_STEPS):
            at = self._percept.tcp_position_m
            far = math.dist(at, to_m)
            if far < within_m:
                return True
            speed = min(FULL_M_S, EASE_PER_S * far)
            dx, dy, dz = ((b - a) / far * speed for a, b in zip(at, to_m, strict=True))
            self._step((dx, dy, dz))
        return False

    def _wait(self, n: int) -> None:
        for _ in range(n):
            self._step((0.0, 0.0, 0.0))

    def _step(self, velocity: Vec3) -> StepResult:
        speed = math.hypot(*velocity)
        self._shake = 0.9 * self._shake + 0.1 * self._rng.normal(0.0, 3.0 * SHAKE, 3)
        x, y, z = (v + float(n) * speed for v, n in zip(velocity, self._shake, strict=True))
        result = self._station.step(Twist(linear_m_s=(x, y, z), grip=self._grip), duration_s=STEP_S)
        self._percept: Percept = result.percept
        self.n_steps += 1
        return result

    def _where(self, name: str) -> Vec3:
        return next(thing.position_m for thing in self._percept.objects if thing.name == name)

    def _is_lit(self, name: str) -> bool:
        i = next(i for i, button in enumerate(self._scenario.buttons) if button.name == name)
        return self._percept.button_states[i] > 0.5
