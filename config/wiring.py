"""Whether a rule set fits a scenario: its outputs, its inputs, and whether every goal can still be reached."""

import msgspec

from config.cell import CellConfig
from config.decode import nearest
from config.errors import ConfigError
from config.reachable import GRIPPER_INPUT, unreachable_goals
from config.rules import RuleSet
from config.scenario import Scenario

__all__ = ["check_cell_fits", "check_reachable", "check_wiring", "signals_of"]


def check_wiring(scenario: Scenario, rules: RuleSet, file: str) -> None:
    """Check that a rule set switches each lid of the scenario once, by inputs that the scenario's cell has.

    Args:
        scenario: the table.
        rules: one of the rule sets in its schedule.
        file: what errors call the rule set's file.

    Raises:
        ConfigError: a name that the scenario does not have, or a lid without a rule.
    """
    lids = [box.name for box in scenario.boxes if box.lid is not None]
    inputs = [button.name for button in scenario.buttons]
    inputs += [box.name for box in scenario.boxes if box.presence_input is not None]
    inputs.append(GRIPPER_INPUT)
    for i, rule in enumerate(rules.rules):
        _check_known(rule.output, lids, "a box with a lid", f"rules[{i}].output", scenario, file)
        for k, literal in enumerate(rule.when):
            what = "a button, a box with a sensor or the gripper"
            _check_known(literal.input, inputs, what, f"rules[{i}].when[{k}].input", scenario, file)
    ruled = {rule.output for rule in rules.rules}
    for lid in lids:
        if lid not in ruled:
            raise ConfigError(file, "rules", f"a rule for each lid of scenario {scenario.name}", f"none for {lid}")


def check_cell_fits(scenario: Scenario, cell: CellConfig, file: str) -> None:
    """Check that a cell has a terminal for every signal of a scenario, and measures the travel of buttons only.

    Raises:
        ConfigError: it lacks one, named as the scenario names it; or what it measures is no button.
    """
    inputs, outputs = signals_of(scenario)
    for key, needed, wired in (
        ("inputs", inputs, {wire.signal for wire in cell.inputs}),
        ("outputs", outputs, {wire.signal for wire in cell.outputs}),
    ):
        for signal, what in needed.items():
            if signal not in wired:
                raise ConfigError(file, key, f"signal {signal}, {what} of scenario {scenario.name}", "no such entry")
    if cell.arming_signal in inputs:
        expected = f"an input that scenario {scenario.name} does not use"
        raise ConfigError(file, "arming_signal", expected, f"{cell.arming_signal}, {inputs[cell.arming_signal]}")
    buttons = sorted(button.input for button in scenario.buttons)
    for i, wire in enumerate(cell.analog_inputs):
        if wire.signal not in buttons:
            expected = f"the input of a button of scenario {scenario.name}: {', '.join(map(str, buttons))}"
            raise ConfigError(file, f"analog_inputs[{i}].signal", expected, str(wire.signal))


def signals_of(scenario: Scenario) -> tuple[dict[int, str], dict[int, str]]:
    """Return what the scenario's inputs and outputs are, in words by their numbers."""
    inputs = {button.input: button.name for button in scenario.buttons}
    inputs |= {b.presence_input: f"{b.name} sensor" for b in scenario.boxes if b.presence_input is not None}
    outputs = {button.lamp_output: f"{button.name} lamp" for button in scenario.buttons}
    outputs |= {box.lid.output: f"{box.name} lid" for box in scenario.boxes if box.lid is not None}
    return inputs, outputs


def check_reachable(scenario: Scenario, rules: RuleSet, where: str, file: str) -> None:
    """Check that every goal can be reached within an epoch under a rule set.

    Raises:
        ConfigError: at `where` in the scenario's `file`, naming the goals that cannot.
    """
    missing = unreachable_goals(scenario, rules)
    if missing:
        off = [name for name, is_on in msgspec.structs.asdict(scenario.reflexes).items() if is_on is False]
        why = f", or it takes a reflex that is off ({', '.join(off)})" if off else ""
        got = f"{rules.name}, under which {', '.join(missing)} cannot: what opens the lids in the way never holds{why}"
        raise ConfigError(file, where, "rules under which every goal can be reached", got)


def _check_known(name: str, known: list[str], what: str, where: str, scenario: Scenario, file: str) -> None:
    if name not in known:
        expected = f"{what} of scenario {scenario.name}: {', '.join(known) or 'there is none'}"
        raise ConfigError(file, where, expected, f"{name}{nearest(name, known)}")
