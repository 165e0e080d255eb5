"""The shipped scenarios can be done: a scripted hand presses, grabs and puts on the twin, under each rule set."""

import pytest

from config.loader import resolve
from robot.operated import OperatedStation
from robot.rigs import build_operator, build_station
from tests.support.scripted_hand import ScriptedHand

CHAINS = [
    ("paper", 0, "green_button red_cylinder"),
    ("paper", 0, "blue_button blue_cylinder>square_box"),
    ("paper", 1000, "red_cylinder"),
    ("paper", 1000, "orange_button blue_cylinder>square_box"),
    ("workshop", 0, "violet_button yellow_button teal_button white_button copper_cylinder"),
    ("workshop", 0, "white_button brass_cylinder>tray"),
    ("workshop", 0, "yellow_button teal_button steel_cylinder>vault"),
    ("workshop", 400, "teal_button brass_cylinder>tray steel_cylinder>vault"),
]
BLOCKED = [
    ("paper", 0, "", "red_cylinder"),
    ("paper", 0, "orange_button", "blue_cylinder"),
    ("paper", 1000, "green_button", "red_cylinder"),
    ("workshop", 0, "yellow_button violet_button", "steel_cylinder"),
    ("workshop", 400, "white_button", "brass_cylinder"),
    ("workshop", 400, "", "steel_cylinder"),
]


@pytest.fixture(scope="module")
def stations():
    opened = {}
    for name in ("paper", "workshop"):
        resolved = resolve(scenario=name)
        opened[name] = OperatedStation(build_station(resolved), build_operator(resolved.rig))
        opened[name].connect()
    yield opened
    for station in opened.values():
        station.close()


def act(hand, scenario, word):
    """Do one word of a chain: a button, a cylinder to grab, or cylinder>box; return whether it came about."""
    buttons = [button.name for button in scenario.buttons]
    if word in buttons:
        return hand.press(buttons.index(word), word)
    cylinder, _, box = word.partition(">")
    return hand.grab(cylinder) and (not box or hand.put(cylinder, box))


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize(("name", "epoch", "chain"), CHAINS)
def test_a_chain_that_the_rules_allow_can_be_carried_out(stations, name, epoch, chain, seed):
    hand = ScriptedHand(stations[name], seed=seed, epoch=epoch)
    scenario = resolve(scenario=name).scenario
    assert [word for word in chain.split() if not act(hand, scenario, word)] == []
    assert hand.refusals == []


@pytest.mark.parametrize(("name", "epoch", "chain", "cylinder"), BLOCKED)
def test_a_shut_lid_keeps_the_hand_out_and_latches_nothing(stations, name, epoch, chain, cylinder):
    hand = ScriptedHand(stations[name], seed=3, epoch=epoch)
    scenario = resolve(scenario=name).scenario
    assert [word for word in chain.split() if not act(hand, scenario, word)] == []
    assert not act(hand, scenario, cylinder)
    assert hand.refusals == []
