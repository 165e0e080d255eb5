"""What must hold between the values of one file, beyond each value's own range."""

import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import PurePath

from config.arm import ArmConfig
from config.cell import CellConfig
from config.decode import nearest
from config.errors import ConfigError
from config.learning import LearningConfig
from config.rig import Rig
from config.rules import RuleSet
from config.scenario import Cylinder, Goal, GoalKind, Scenario
from config.sweep import Sweep
from config.yaml_text import join

__all__ = [
    "RESERVED_NAMES",
    "Checker",
    "check_arm",
    "check_learning",
    "check_rig",
    "check_rules",
    "check_scenario",
    "check_sweep",
]

RESERVED_NAMES = ("table", "gripper", "hand", "tool", "world")
"""Names that mean something by themselves in distances, rules or the simulated world."""
ROUNDING_M = 1e-9
TWIN = "twin"
CAP_M = 0.015
"""Height of a button's cap and of the ring that holds it."""


class Checker:
    """Raises for the first thing that does not hold, naming file and place."""

    def __init__(self, file: str) -> None:
        self._file = file

    def need(self, holds: bool, where: str, expected: str, got: str) -> None:
        """Raise unless it holds."""
        if not holds:
            raise ConfigError(self._file, where, expected, got)

    def known(self, name: str, known: Iterable[str], where: str, what: str) -> None:
        """Raise unless the name is one of the known ones."""
        names = list(known)
        if name not in names:
            expected = f"{what}: {', '.join(names) or 'there is none'}"
            raise ConfigError(self._file, where, expected, f"{name}{nearest(name, names)}")

    def unique(self, values: Iterable[tuple[str, object]], what: str) -> None:
        """Raise where a value comes a second time; values come with their places."""
        first: dict[object, str] = {}
        for where, value in values:
            self.need(value not in first, where, f"{what} used once", f"{value} again, after {first.get(value)}")
            first[value] = where

    def ascending(self, pair: Sequence[float], where: str) -> None:
        """Raise unless the first of two values is the lesser."""
        self.need(pair[0] < pair[1], where, "the lesser value first", f"{pair[0]:g} and {pair[1]:g}")


def check_arm(arm: ArmConfig, file: str) -> None:
    """Check ranges, tool and motion limits of an arm."""
    checker = Checker(file)
    checker.unique(((f"joints[{i}].name", joint.name) for i, joint in enumerate(arm.joints)), "a joint name")
    for i, (joint, home_rad) in enumerate(zip(arm.joints, arm.home_rad, strict=True)):
        low, high = joint.range_rad
        checker.ascending(joint.range_rad, f"joints[{i}].range_rad")
        checker.need(low <= home_rad <= high, f"home_rad[{i}]", f"an angle from {low:g} to {high:g}", f"{home_rad:g}")
    for i, capsule in enumerate(arm.capsules):
        length_m = math.dist(capsule.from_m, capsule.to_m)
        checker.need(length_m > 1e-4, f"capsules[{i}].to_m", "another point than from_m", "the same point")
    _check_tool(arm, checker)
    _check_motion(arm, checker)


def _check_tool(arm: ArmConfig, checker: Checker) -> None:
    tool = arm.tool
    checker.ascending(tool.force_n, "tool.force_n")
    checker.ascending(tool.speed_m_s, "tool.speed_m_s")
    low, high = tool.force_n
    checker.need(
        low <= tool.grip_force_n <= high,
        "tool.grip_force_n",
        f"a force from {low:g} to {high:g}",
        f"{tool.grip_force_n:g}",
    )
    tall_m = tool.pad_size_m[2]
    checker.need(
        tall_m <= tool.finger_depth_m,
        "tool.pad_size_m[2]",
        f"at most finger_depth_m = {tool.finger_depth_m:g}",
        f"{tall_m:g}",
    )
    reach_m = tool.tcp_m[2] - tool.finger_depth_m
    checker.need(
        reach_m > 0.0, "tool.finger_depth_m", f"less than tcp_m[2] = {tool.tcp_m[2]:g}", f"{tool.finger_depth_m:g}"
    )


def _check_motion(arm: ArmConfig, checker: Checker) -> None:
    motion, low, high = arm.motion, *arm.motion.workspace_m
    for axis in range(3):
        checker.ascending((low[axis], high[axis]), f"motion.workspace_m[1][{axis}]")
    checker.ascending(motion.heights_m, "motion.heights_m")
    roof_m = low[2] + motion.heights_m[1] - motion.heights_m[0]
    checker.need(
        high[2] >= roof_m - ROUNDING_M,
        "motion.workspace_m[1][2]",
        f"at least {roof_m:g}, so that both heights_m lie within",
        f"{high[2]:g}",
    )
    tip_m = motion.heights_m[0] - arm.tool.tip_below_tcp_m
    checker.need(
        tip_m >= motion.table_clearance_m,
        "motion.heights_m[0]",
        f"at least {motion.table_clearance_m + arm.tool.tip_below_tcp_m:g}, tip_below_tcp_m and table_clearance_m",
        f"{motion.heights_m[0]:g}",
    )
    checker.need(
        motion.leash_m >= motion.max_step_m,
        "motion.leash_m",
        f"at least max_step_m = {motion.max_step_m:g}",
        f"{motion.leash_m:g}",
    )
    checker.need(
        motion.contact_force_n < motion.force_limit_n,
        "motion.contact_force_n",
        f"less than force_limit_n = {motion.force_limit_n:g}",
        f"{motion.contact_force_n:g}",
    )
    checker.need(
        motion.contact_force_n <= motion.hard_force_n < motion.force_limit_n,
        "motion.hard_force_n",
        f"at least contact_force_n = {motion.contact_force_n:g} and less than force_limit_n = {motion.force_limit_n:g}",
        f"{motion.hard_force_n:g}",
    )
    checker.need(
        motion.force_limit_n <= motion.impact_limit_n,
        "motion.impact_limit_n",
        f"at least force_limit_n = {motion.force_limit_n:g}",
        f"{motion.impact_limit_n:g}",
    )


def check_rig(rig: Rig, file: str) -> None:
    """Check that a rig's ticks are made of whole physics steps, and that only a twin is to differ from its files."""
    n_steps = rig.tick_s / rig.physics_s
    is_whole = n_steps >= 0.5 and abs(n_steps - round(n_steps)) < 1e-6
    checker = Checker(file)
    checker.need(is_whole, "physics_s", f"a whole part of tick_s = {rig.tick_s:g}", f"{rig.physics_s:g}")
    can_differ = rig.perturbation is None or rig.expected.kind == TWIN
    checker.need(
        can_differ, "perturbation", "none but for a twin, whose physics can be changed", f"one, of {rig.expected.kind}"
    )


def check_sweep(sweep: Sweep, file: str) -> None:
    """Check that nothing comes twice, by the names that the cells will have."""
    checker = Checker(file)
    for key in ("presets", "scenarios", "rigs"):
        stems = [(f"{key}[{i}]", PurePath(name).stem) for i, name in enumerate(getattr(sweep, key))]
        checker.unique(stems, "a file's name")
    checker.unique(((f"seeds[{i}]", seed) for i, seed in enumerate(sweep.seeds)), "a seed")


def check_cell(cell: CellConfig, file: str) -> None:
    """Check that every signal is wired once and no terminal twice, that pulses are whole, and that voltages differ."""
    checker = Checker(file)
    for key, wires in (("inputs", cell.inputs), ("outputs", cell.outputs)):
        checker.unique(((f"{key}[{i}].signal", str(wire.signal)) for i, wire in enumerate(wires)), "a signal")
    checker.unique(((f"inputs[{i}].pin", wire.pin) for i, wire in enumerate(cell.inputs)), "a terminal")
    pins = [(f"outputs[{i}].pin", wire.pin) for i, wire in enumerate(cell.outputs)]
    pins += [(f"outputs[{i}].off_pin", wire.off_pin) for i, wire in enumerate(cell.outputs) if wire.off_pin is not None]
    checker.unique(pins, "a terminal")
    is_wired = cell.arming_signal is None or cell.arming_signal in {wire.signal for wire in cell.inputs}
    checker.need(is_wired, "arming_signal", "the signal of one of the inputs", str(cell.arming_signal))
    checker.unique(((f"analog_inputs[{i}].pin", wire.pin) for i, wire in enumerate(cell.analog_inputs)), "a terminal")
    for i, (released, pressed) in enumerate(wire.volts for wire in cell.analog_inputs):
        got = f"{released:g} and {pressed:g}"
        checker.need(released != pressed, f"analog_inputs[{i}].volts", "two voltages that differ", got)
    for i, wire in enumerate(cell.outputs):
        has_both = (wire.off_pin is None) == (wire.pulse_s is None)
        checker.need(has_both, f"outputs[{i}].pulse_s", "off_pin and pulse_s, or neither", "one of them")
        is_plain = wire.off_pin is None or not wire.inverted
        checker.need(is_plain, f"outputs[{i}].inverted", "false for a drive that takes pulses", "true")


def check_learning(learning: LearningConfig, file: str) -> None:
    """Check that a learner can move and can fill its batches."""
    checker = Checker(file)
    shares = learning.actions.distance_shares
    checker.need(max(shares) > 0.0, "actions.distance_shares", "at least one share above 0", "only 0")
    expert = learning.expert
    checker.need(
        expert.batch <= expert.buffer_steps,
        "expert.batch",
        f"at most buffer_steps = {expert.buffer_steps}",
        f"{expert.batch}",
    )


def check_rules(rules: RuleSet, file: str) -> None:
    """Check a rule set by itself: one rule an output, each input once a rule and without contradiction."""
    checker = Checker(file)
    checker.unique(((f"rules[{i}].output", rule.output) for i, rule in enumerate(rules.rules)), "an output")
    for i, rule in enumerate(rules.rules):
        is_on_by_input: dict[str, bool] = {}
        for k, literal in enumerate(rule.when):
            before = is_on_by_input.setdefault(literal.input, literal.is_on)
            got = f"{literal.input} again" if before == literal.is_on else f"{literal.input} on and off at once"
            is_first = literal.input not in [earlier.input for earlier in rule.when[:k]]
            checker.need(is_first, f"rules[{i}].when[{k}].input", "each input once, so that the rule can hold", got)


def check_scenario(scenario: Scenario, file: str) -> None:
    """Check names, wiring, references, goals and schedule of a scenario. Its geometry is checked in config.placing."""
    checker = Checker(file)
    _check_names(scenario, checker)
    _check_wiring(scenario, checker)
    boxes = [box.name for box in scenario.boxes]
    for i, cylinder in enumerate(scenario.cylinders):
        _check_cylinder(cylinder, boxes, f"cylinders[{i}]", checker)
    _check_distances(scenario, checker)
    for i, button in enumerate(scenario.buttons):
        least_m = button.travel_m + CAP_M
        is_high = button.height_m >= least_m
        checker.need(is_high, f"buttons[{i}].height_m", f"at least {least_m:g}, cap and travel", f"{button.height_m:g}")
    for i, goal in enumerate(scenario.goals):
        _check_goal(goal, scenario, f"goals[{i}]", checker)
    _check_arrivals(scenario, checker)
    _check_seen(scenario, checker)
    if scenario.workspace_m is not None:
        for axis, pair in enumerate(zip(*scenario.workspace_m, strict=True)):
            checker.ascending(pair, f"workspace_m[1][{axis}]")
    starts = [span.from_epoch for span in scenario.schedule]
    checker.need(starts[0] == 0, "schedule[0].from_epoch", "0, the first epoch", f"{starts[0]}")
    for i in range(1, len(starts)):
        expected = f"an epoch after {starts[i - 1]}"
        checker.need(starts[i] > starts[i - 1], f"schedule[{i}].from_epoch", expected, f"{starts[i]}")


def _check_names(scenario: Scenario, checker: Checker) -> None:
    groups = {"buttons": scenario.buttons, "boxes": scenario.boxes, "cylinders": scenario.cylinders}
    places = [(f"{group}[{i}].name", thing.name) for group, things in groups.items() for i, thing in enumerate(things)]
    checker.unique(places, "a name")
    for where, name in places:
        checker.need(name not in RESERVED_NAMES, where, f"a name other than {', '.join(RESERVED_NAMES)}", name)
    checker.unique(((f"goals[{i}].name", goal.name) for i, goal in enumerate(scenario.goals)), "a goal's name")


def _check_wiring(scenario: Scenario, checker: Checker) -> None:
    buttons = list(enumerate(scenario.buttons))
    boxes = list(enumerate(scenario.boxes))
    inputs = [(f"buttons[{i}].input", button.input) for i, button in buttons]
    inputs += [(f"boxes[{i}].presence_input", box.presence_input) for i, box in boxes if box.presence_input is not None]
    outputs = [(f"buttons[{i}].lamp_output", button.lamp_output) for i, button in buttons]
    outputs += [(f"boxes[{i}].lid.output", box.lid.output) for i, box in boxes if box.lid is not None]
    checker.unique(inputs, "a digital input")
    checker.unique(outputs, "a digital output")


def _check_cylinder(cylinder: Cylinder, boxes: list[str], where: str, checker: Checker) -> None:
    if cylinder.inside is not None:
        checker.known(cylinder.inside, boxes, join(where, "inside"), "a box")
    if cylinder.receptacle is not None:
        checker.known(cylinder.receptacle, boxes, join(where, "receptacle"), "a box")
        elsewhere = cylinder.receptacle != cylinder.inside
        checker.need(elsewhere, join(where, "receptacle"), "another box than it starts in", cylinder.receptacle)


def _check_distances(scenario: Scenario, checker: Checker) -> None:
    things = [thing.name for group in (scenario.buttons, scenario.boxes, scenario.cylinders) for thing in group]
    for i, name in enumerate(scenario.distances):
        checker.known(name, [*things, "table"], f"distances[{i}]", "an object or table")
    checker.unique(((f"distances[{i}]", name) for i, name in enumerate(scenario.distances)), "a distance")


def _check_arrivals(scenario: Scenario, checker: Checker) -> None:
    """Goals are numbered as they become known, so that a new one changes no other's number."""
    starts = [goal.from_epoch for goal in scenario.goals]
    checker.need(starts[0] == 0, "goals[0].from_epoch", "0: a goal that is known from the first epoch", f"{starts[0]}")
    for i in range(1, len(starts)):
        expected = f"at least {starts[i - 1]}, as of the goal before: those that become known later come later"
        checker.need(starts[i] >= starts[i - 1], f"goals[{i}].from_epoch", expected, f"{starts[i]}")


def _check_seen(scenario: Scenario, checker: Checker) -> None:
    named = dict.fromkeys(name for goal in scenario.goals for name in (goal.object, goal.box) if name is not None)
    missing = [name for name in named if name not in scenario.distances]
    expected = f"every object that a goal names, since the learner is blind to others: {', '.join(named)}"
    checker.need(not missing, "distances", expected, f"none to {', '.join(missing)}")


def _check_goal(goal: Goal, scenario: Scenario, where: str, checker: Checker) -> None:
    of_kind: dict[GoalKind, Callable[[], None]] = {
        GoalKind.PRESSED: lambda: checker.known(
            goal.object, (button.name for button in scenario.buttons), join(where, "object"), "a button"
        ),
        GoalKind.GRABBED: lambda: _check_goal_cylinder(goal, scenario, where, checker),
        GoalKind.IN_BOX: lambda: _check_goal_in_box(goal, scenario, where, checker),
    }
    of_kind[goal.kind]()
    if goal.kind is not GoalKind.IN_BOX:
        checker.need(goal.box is None, join(where, "box"), f"no box for kind {goal.kind.value}", f"{goal.box}")


def _check_goal_cylinder(goal: Goal, scenario: Scenario, where: str, checker: Checker) -> None:
    names = [cylinder.name for cylinder in scenario.cylinders if not cylinder.is_distractor]
    checker.known(goal.object, names, join(where, "object"), "a cylinder that is no distractor")


def _check_goal_in_box(goal: Goal, scenario: Scenario, where: str, checker: Checker) -> None:
    _check_goal_cylinder(goal, scenario, where, checker)
    checker.need(goal.box is not None, join(where, "box"), "a box, since the kind is in_box", "nothing")
    checker.known(goal.box or "", (box.name for box in scenario.boxes), join(where, "box"), "a box")
    cylinder = next(cylinder for cylinder in scenario.cylinders if cylinder.name == goal.object)
    expected = f"{cylinder.receptacle or 'nothing'}, the receptacle that the hand opens over"
    checker.need(goal.box == cylinder.receptacle, join(where, "box"), expected, f"{goal.box}")
