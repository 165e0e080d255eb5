"""The table's wiring: latched inputs switch lamps and lids by the rules in force. It proposes; the gate writes."""

import math
from typing import Any

import msgspec

from config.arm import ArmConfig
from config.reachable import GRIPPER_INPUT
from config.rules import RuleSet
from config.scenario import Box, Scenario
from robot.errors import RobotConfigError
from robot.geometry import inside_box
from robot.messages import ArmState, Vec3

__all__ = ["Cell"]

SWEEP_MARGIN_M = 0.005
HELD_BELOW_M = 0.035
"""What the hand carries may reach this far below the tool centre point."""
GRIPPER_BIT = 1 << 16
"""The hand's object-detected flag, above the sixteen digital inputs."""


class _Condition(msgspec.Struct, frozen=True):
    """When a lid's output is on: these latched inputs on, those off."""

    output_bit: int
    on_mask: int
    off_mask: int

    def holds(self, latched: int) -> bool:
        """Return whether every literal holds."""
        return latched & self.on_mask == self.on_mask and not latched & self.off_mask


class _Sweep(msgspec.Struct, frozen=True):
    """Where the tool would be in a moving lid's way."""

    output_bit: int
    low_m: Vec3
    high_m: Vec3


class Cell:
    """Runs the table between read and gate: state of one cell, pure otherwise.

    Inputs latch for the epoch: a button once pressed counts as pressed, and its lamp stays lit. A lid does not begin
    to move while the tool is in its way; it moves as soon as the tool is gone.

    Args:
        scenario: Buttons, boxes and the schedule of rules.
        rule_sets: The i-th is in force from the i-th span of the schedule.
        arm: For the size of the tool.
    """

    def __init__(self, *, scenario: Scenario, rule_sets: tuple[RuleSet, ...], arm: ArmConfig) -> None:
        self._lamps = {1 << b.input: 1 << b.lamp_output for b in scenario.buttons}
        self._input_bits = {b.name: 1 << b.input for b in scenario.buttons}
        self._input_bits |= {b.name: 1 << b.presence_input for b in scenario.boxes if b.presence_input is not None}
        self._input_bits[GRIPPER_INPUT] = GRIPPER_BIT
        self._mask = sum(self._input_bits.values())
        self._output_bits = {b.name: 1 << b.lid.output for b in scenario.boxes if b.lid is not None}
        self._sweeps = tuple(_sweep(b, scenario, arm) for b in scenario.boxes if b.lid is not None)
        if len(rule_sets) != len(scenario.schedule):
            raise RobotConfigError(f"expected {len(scenario.schedule)} rule sets, one a span, came {len(rule_sets)}")
        spans = zip(scenario.schedule, rule_sets, strict=True)
        self._spans = sorted(((s.from_epoch, self._conditions(rules)) for s, rules in spans), key=lambda s: s[0])
        self._begin(0)

    @property
    def digital_out(self) -> int:
        """Outputs proposed last."""
        return self._digital_out

    def begin_epoch(self, epoch: int) -> int:
        """Forget what was latched, put the epoch's rules in force and return the outputs to start from."""
        self._begin(epoch)
        return self._digital_out

    def outputs_at(self, epoch: int) -> int:
        """Return the outputs that an epoch starts from. Nothing changes."""
        return self._want(self._rules_at(epoch), 0)

    def tick(self, state: ArmState) -> int:
        """Take in the inputs of one tick and return the outputs to write.

        Args:
            state: Inputs, the hand's flag and where the tool is.
        """
        latched = self._latched | state.digital_in & self._mask
        if state.grip.has_object:
            latched |= GRIPPER_BIT
        if latched != self._latched:
            self._latched = latched
            self._wanted = self._want(self._rules, self._latched)
        if self._wanted != self._digital_out:
            self._digital_out = self._allow(state.tcp_position_m)
        return self._digital_out

    def state_dict(self) -> dict[str, Any]:
        """Return what the cell remembers."""
        return {"epoch": self._epoch, "latched": self._latched, "digital_out": self._digital_out}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore what `state_dict` returned."""
        self._begin(int(state["epoch"]))
        self._latched = int(state["latched"])
        self._wanted = self._want(self._rules, self._latched)
        self._digital_out = int(state["digital_out"])

    def _begin(self, epoch: int) -> None:
        self._epoch, self._rules = epoch, self._rules_at(epoch)
        self._latched = 0
        self._wanted = self._digital_out = self._want(self._rules, 0)

    def _rules_at(self, epoch: int) -> tuple[_Condition, ...]:
        in_force = [conditions for from_epoch, conditions in self._spans if from_epoch <= epoch]
        if not in_force:
            raise RobotConfigError(f"no rules in force at epoch {epoch}: the schedule begins at {self._spans[0][0]}")
        return in_force[-1]

    def _want(self, rules: tuple[_Condition, ...], latched: int) -> int:
        bits = 0
        for input_bit, lamp_bit in self._lamps.items():
            if latched & input_bit:
                bits |= lamp_bit
        for condition in rules:
            if condition.holds(latched):
                bits |= condition.output_bit
        return bits

    def _allow(self, tcp_m: Vec3) -> int:
        """Change every output that may change: all but lids with the tool in their way."""
        wanted = self._wanted
        for sweep in self._sweeps:
            differs = (wanted ^ self._digital_out) & sweep.output_bit
            if differs and inside_box(tcp_m, sweep.low_m, sweep.high_m):
                wanted ^= sweep.output_bit
        return wanted

    def _conditions(self, rules: RuleSet) -> tuple[_Condition, ...]:
        conditions = []
        for rule in rules.rules:
            if rule.output not in self._output_bits:
                raise RobotConfigError(
                    f"rules {rules.name}: expected one of {list(self._output_bits)}, came {rule.output}"
                )
            on = off = 0
            for literal in rule.when:
                if literal.input not in self._input_bits:
                    known = list(self._input_bits)
                    raise RobotConfigError(f"rules {rules.name}: expected one of {known}, came {literal.input}")
                bit = self._input_bits[literal.input]
                on, off = (on | bit, off) if literal.is_on else (on, off | bit)
            conditions.append(_Condition(self._output_bits[rule.output], on, off))
        return tuple(conditions)


def _sweep(box: Box, scenario: Scenario, arm: ArmConfig) -> _Sweep:
    """Return where the tool could touch a lid's leaves on their way, wherever the box is drawn.

    A leaf spans half the box; opened past upright it leans out by -cos(angle) of its length.
    """
    assert box.lid is not None
    tool = arm.tool
    tool_m = tool.stroke_m / 2 + tool.pad_size_m[0] + SWEEP_MARGIN_M
    leaf_m = max(box.inner_m) / 2 + box.wall_m
    reach_m = box.wall_m + leaf_m * max(0.0, -math.cos(box.lid.open_angle_rad)) + tool_m
    half = [inner / 2 + spread + reach_m for inner, spread in zip(box.inner_m, box.spread_m, strict=True)]
    x, y = box.position_m
    table_m = scenario.table.height_m
    top_m = table_m + box.height_m + leaf_m + max(tool.tip_below_tcp_m, HELD_BELOW_M)
    return _Sweep(1 << box.lid.output, (x - half[0], y - half[1], table_m - 1.0), (x + half[0], y + half[1], top_m))
