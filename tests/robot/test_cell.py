import itertools

import msgspec
import pytest

from config.rules import Literal, Rule, RuleSet
from robot.cell import Cell
from robot.errors import RobotConfigError
from robot.messages import GripState
from tests.support.stations import arm_state, fake_rig

RESOLVED = fake_rig()
SCENARIO, ARM, RULE_SETS = RESOLVED.scenario, RESOLVED.arm, RESOLVED.rule_sets
SWITCH = SCENARIO.schedule[1].from_epoch
HOME = tuple(ARM.home_rad)
AWAY = (0.42, 0.0, 0.21)
BUTTONS = {b.name: 1 << b.input for b in SCENARIO.buttons}
LAMPS = {b.name: 1 << b.lamp_output for b in SCENARIO.buttons}
LIDS = {b.name: 1 << b.lid.output for b in SCENARIO.boxes if b.lid}
HOLDING = GripState(opening_m=0.044, is_moving=False, has_object=True)


def make(rule_sets=RULE_SETS):
    return Cell(scenario=SCENARIO, rule_sets=rule_sets, arm=ARM)


def tick(cell, *pressed, tcp=AWAY, **more):
    bits = sum(BUTTONS[name] for name in pressed)
    return cell.tick(arm_state(HOME, tcp_m=tcp, digital_in=bits, **more))


def lids(outputs):
    return {name for name, bit in LIDS.items() if outputs & bit}


def lamps(outputs):
    return {name for name, bit in LAMPS.items() if outputs & bit}


@pytest.mark.parametrize("epoch", [0, SWITCH - 1])
def test_before_the_switch_green_and_blue_open_and_the_square_box_is_open(epoch):
    cell = make()
    assert lids(cell.begin_epoch(epoch)) == {"square_box"}
    assert lids(tick(cell, "green_button")) == {"square_box", "red_box"}
    assert lids(tick(cell, "blue_button")) == {"square_box", "red_box", "blue_box"}


@pytest.mark.parametrize("epoch", [SWITCH, SWITCH + 500])
def test_after_the_switch_they_shut_and_orange_opens_the_square_box(epoch):
    cell = make()
    assert lids(cell.begin_epoch(epoch)) == {"red_box", "blue_box"}
    assert lids(tick(cell, "green_button")) == {"blue_box"}
    assert lids(tick(cell, "blue_button")) == set()
    assert lids(tick(cell, "orange_button")) == {"square_box"}


def test_what_an_epoch_begins_with_is_told_before_its_rules_are_in_force():
    cell = make()
    began = cell.begin_epoch(0)
    assert lids(cell.outputs_at(SWITCH)) == {"red_box", "blue_box"}
    assert cell.digital_out == began == tick(cell)
    assert cell.begin_epoch(SWITCH) == cell.outputs_at(SWITCH)


def test_inputs_latch_for_the_epoch_and_lamps_show_them():
    cell = make()
    cell.begin_epoch(0)
    assert lamps(tick(cell)) == set()
    tick(cell, "green_button")
    assert lamps(tick(cell)) == {"green_button"}
    assert lids(tick(cell)) == {"square_box", "red_box"}
    assert lamps(tick(cell, "blue_button")) == {"green_button", "blue_button"}


def test_the_next_epoch_forgets_what_was_latched():
    cell = make()
    cell.begin_epoch(0)
    tick(cell, "green_button", "blue_button")
    assert lids(cell.begin_epoch(1)) == {"square_box"}
    assert lamps(tick(cell)) == set()


@pytest.mark.parametrize("pressed", list(itertools.product([False, True], repeat=3)))
def test_lids_are_exactly_the_literals_of_the_rules_in_force(pressed):
    on = [name for name, is_on in zip(BUTTONS, pressed, strict=True) if is_on]
    for epoch, rules in ((0, RULE_SETS[0]), (SWITCH, RULE_SETS[1])):
        cell = make()
        cell.begin_epoch(epoch)
        expected = {r.output for r in rules.rules if all((w.input in on) == w.is_on for w in r.when)}
        assert lids(tick(cell, *on)) == expected


def test_a_box_sensor_and_the_gripper_are_inputs_too():
    rules = RuleSet(
        name="sensed",
        rules=(
            Rule(output="red_box", when=(Literal(input="gripper", is_on=True),)),
            Rule(output="blue_box", when=(Literal(input="square_box", is_on=True),)),
            Rule(output="square_box"),
        ),
    )
    cell = make((rules, rules))
    assert lids(cell.begin_epoch(0)) == {"square_box"}
    assert lids(tick(cell, grip=HOLDING)) == {"square_box", "red_box"}
    sensor = next(1 << b.presence_input for b in SCENARIO.boxes if b.presence_input is not None)
    assert lids(cell.tick(arm_state(HOME, tcp_m=AWAY, digital_in=sensor))) == {"square_box", "red_box", "blue_box"}
    assert lids(tick(cell)) == {"square_box", "red_box", "blue_box"}


def test_no_lid_moves_while_the_tool_is_in_its_sweep_but_lamps_and_other_lids_do():
    cell = make()
    cell.begin_epoch(0)
    x, y = next(b.position_m for b in SCENARIO.boxes if b.name == "red_box")
    inside = (x, y, 0.1)
    outputs = tick(cell, "green_button", "blue_button", tcp=inside)
    assert lids(outputs) == {"square_box", "blue_box"}
    assert lamps(outputs) == {"green_button", "blue_button"}
    assert lids(tick(cell, tcp=inside)) == {"square_box", "blue_box"}
    assert lids(tick(cell)) == {"square_box", "blue_box", "red_box"}


def test_a_sweep_reaches_as_far_as_the_tool_and_what_it_holds():
    # The tool's centre beside the box, or above its lid: its fingers, or what hangs below them, are in the way.
    box = next(b for b in SCENARIO.boxes if b.name == "red_box")
    x, y = box.position_m
    beside = (x, y + box.spread_m[1] + box.inner_m[1] / 2 + box.wall_m + 0.03, 0.1)
    above = (x, y, SCENARIO.table.height_m + box.height_m + box.inner_m[0] / 2 + 0.02)
    for place in (beside, above):
        cell = make()
        cell.begin_epoch(0)
        assert "red_box" not in lids(tick(cell, "green_button", tcp=place)), place


def test_travel_height_is_above_every_sweep():
    for box in SCENARIO.boxes:
        cell = make()
        cell.begin_epoch(0)
        over = (*box.position_m, ARM.motion.heights_m[1])
        assert len(lids(tick(cell, "green_button", "blue_button", tcp=over))) == 3


def test_every_place_a_box_can_be_drawn_at_is_inside_its_sweep():
    for box in SCENARIO.boxes:
        for sx, sy in itertools.product((-1, 1), repeat=2):
            cell = make()
            cell.begin_epoch(0)
            before = lids(cell.digital_out)
            x = box.position_m[0] + sx * (box.spread_m[0] + box.inner_m[0] / 2)
            y = box.position_m[1] + sy * (box.spread_m[1] + box.inner_m[1] / 2)
            after = lids(tick(cell, "green_button", "blue_button", tcp=(x, y, 0.1)))
            assert (box.name in before) == (box.name in after)


def test_a_cell_restored_goes_on_as_if_never_stopped():
    one, other = make(), make()
    one.begin_epoch(SWITCH)
    tick(one, "green_button")
    other.load_state_dict(msgspec.json.decode(msgspec.json.encode(one.state_dict())))
    for pressed in ((), ("orange_button",), ("blue_button",), ()):
        assert tick(one, *pressed) == tick(other, *pressed)


@pytest.mark.parametrize(
    "rule",
    [Rule(output="no_such_box"), Rule(output="red_box", when=(Literal(input="no_such_button", is_on=True),))],
)
def test_a_rule_about_what_the_cell_does_not_have_is_refused(rule):
    with pytest.raises(RobotConfigError, match="no_such"):
        make((RuleSet(name="wrong", rules=(rule,)),) * 2)


def test_each_span_needs_a_rule_set_and_every_epoch_a_span():
    with pytest.raises(RobotConfigError, match="expected 2 rule sets"):
        make(RULE_SETS[:1])
    late = tuple(msgspec.structs.replace(s, from_epoch=s.from_epoch + 5) for s in SCENARIO.schedule)
    with pytest.raises(RobotConfigError, match="no rules in force at epoch 0"):
        Cell(scenario=msgspec.structs.replace(SCENARIO, schedule=late), rule_sets=RULE_SETS, arm=ARM)
