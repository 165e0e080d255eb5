"""The table without physics, its lids driven by the rule sets in force: a whole experiment in seconds.

The cell's latches and conditions are worked out here anew, beside the robot's own.
"""

import numpy as np

from config.reachable import GRIPPER_INPUT
from config.resolved import Resolved
from robot.messages import Intent, Percept, StepResult
from tests.support.kinematic_table import KinematicTable

__all__ = ["RuledTable"]


class RuledTable(KinematicTable):
    """A kinematic table whose lids follow its rules, epoch by epoch."""

    def __init__(self, resolved: Resolved, *, column_order: tuple[int, ...] | None = None) -> None:
        super().__init__(resolved.scenario, column_order=column_order)
        self._resolved = resolved
        self._rules = resolved.rule_sets[0]
        self._latched: set[str] = set()

    def reset(self, *, seed: int, epoch: int) -> Percept:
        super().reset(seed=seed, epoch=epoch)
        self._rules = self._resolved.rules_at(epoch)
        self._latched = {c.inside for c in self.scenario.cylinders if c.inside is not None}
        self._drive_lids()
        return self._percept()

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        result = super().step(intent, duration_s=duration_s)
        self._latched |= self.pressed
        if self.held is not None:
            self._latched.add(GRIPPER_INPUT)
        for box in self.scenario.boxes:
            if any(self._is_in(c.name, box) and self.held != c.name for c in self.scenario.cylinders):
                self._latched.add(box.name)
        self._drive_lids()
        return result

    def _drive_lids(self) -> None:
        lidded = {box.name for box in self.scenario.boxes if box.lid is not None}
        for rule in self._rules.rules:
            if rule.output not in lidded:
                continue
            is_open = all((literal.input in self._latched) == literal.is_on for literal in rule.when)
            place = self._place[rule.output]
            is_inside = bool(np.abs(self.tcp[:2] - place[:2]).max() < 0.12) and self.tcp[2] < 0.12
            if is_open:
                self.shut.discard(rule.output)
            elif not is_inside:  # no lid moves while the tool is in its way
                self.shut.add(rule.output)
