"""At a limit of the geometry a scenario passes, a hair beyond it does not."""

from pathlib import Path

import msgspec
import pytest

from config.errors import ConfigError
from config.loader import load_arm, resolve
from config.placing import check_fit, check_placing
from config.scenario import Box, Button, Cylinder, Goal, GoalKind, Lid, RuleSpan, Scenario, Table

HAIR_M = 1e-6
GREY = (0.5, 0.5, 0.5)
ARM = load_arm("ur5e")


def table(*, button_x=0.5, second_x=None, box_y=0.3, jar_spread=0.0, lid_angle=None):
    """One button or two in a row along x, a box with a jar beside them."""
    buttons = [Button(name="one", position_m=(button_x, 0), colour=GREY, diameter_m=0.1, input=0, lamp_output=0)]
    if second_x is not None:
        buttons.append(
            Button(name="two", position_m=(second_x, 0), colour=GREY, diameter_m=0.1, input=1, lamp_output=1)
        )
    lid = None if lid_angle is None else Lid(output=2, open_angle_rad=lid_angle)
    return Scenario(
        name="toy",
        table=Table(centre_m=(0.5, 0.0), size_m=(0.8, 1.0)),
        buttons=tuple(buttons),
        boxes=(Box(name="box", position_m=(0.5, box_y), colour=GREY, inner_m=(0.2, 0.2), wall_m=0.01, lid=lid),),
        cylinders=(Cylinder(name="jar", inside="box", spread_m=(0.0, jar_spread), colour=GREY, diameter_m=0.04),),
        distances=("table",),
        goals=(
            Goal(name="jar_grabbed", kind=GoalKind.GRABBED, object="jar"),
            Goal(name="one_pressed", kind=GoalKind.PRESSED, object="one"),
        ),
        schedule=(RuleSpan(from_epoch=0, rules="any"),),
    )


@pytest.mark.parametrize(
    ("inside", "beyond", "where"),
    [
        ({"second_x": 0.612}, {"second_x": 0.612 - HAIR_M}, "buttons[1].position_m"),
        ({"button_x": 0.156}, {"button_x": 0.156 - HAIR_M}, "buttons[0].position_m"),
        ({"button_x": 0.844}, {"button_x": 0.844 + HAIR_M}, "buttons[0].position_m"),
        ({"box_y": 0.39}, {"box_y": 0.39 + HAIR_M}, "boxes[0].position_m"),
        ({"box_y": 0.166}, {"box_y": 0.166 - HAIR_M}, "boxes[0].position_m"),
        ({"jar_spread": 0.08}, {"jar_spread": 0.08 + HAIR_M}, "cylinders[0].position_m"),
    ],
    ids=["beside one another", "table's near edge", "table's far edge", "table's side", "box and button", "in the box"],
)
def test_things_may_touch_but_not_overlap_in_any_draw(inside, beyond, where):
    check_placing(table(**inside), "file")
    with pytest.raises(ConfigError) as caught:
        check_placing(table(**beyond), "file")
    assert caught.value.where == where


@pytest.mark.parametrize("key", ["inside", "receptacle"])
def test_a_lid_shuts_over_what_stands_in_its_box_and_an_open_box_holds_taller_things(key):
    def holding(height_m, lid_angle):
        scenario = table(lid_angle=lid_angle)
        jar = msgspec.structs.replace(scenario.cylinders[0], inside=None, position_m=(0.5, -0.2), height_m=height_m)
        place = {"inside": "box", "position_m": (0.0, 0.0)} if key == "inside" else {"receptacle": "box"}
        return msgspec.structs.replace(scenario, cylinders=(msgspec.structs.replace(jar, **place),))

    most_m = table().boxes[0].height_m - 0.002
    check_placing(holding(most_m, 1.85), "file")
    check_placing(holding(2 * most_m, None), "file")
    with pytest.raises(ConfigError) as caught:
        check_placing(holding(most_m + HAIR_M, 1.85), "file")
    assert caught.value.where == "cylinders[0].height_m"


def test_the_hand_must_find_room_between_the_walls():
    room_m = 0.1 - ARM.tool.stroke_m / 2 - ARM.tool.pad_size_m[0]
    check_fit(table(box_y=0.25, jar_spread=room_m), ARM, "file")
    with pytest.raises(ConfigError) as caught:
        check_fit(table(box_y=0.25, jar_spread=room_m + HAIR_M), ARM, "file")
    assert caught.value.where == "cylinders[0].spread_m[1]"


def test_a_turned_hand_needs_its_room_along_the_other_axis():
    turned = msgspec.structs.replace(ARM, tool_yaw_rad=1.5707963267948966)
    room_m = 0.1 - ARM.tool.pad_size_m[1] / 2
    check_fit(table(box_y=0.25, jar_spread=room_m - 0.01), turned, "file")
    with pytest.raises(ConfigError):
        check_fit(table(box_y=0.25, jar_spread=room_m - 0.01), ARM, "file")


@pytest.mark.parametrize("axis", [0, 1])
def test_what_a_goal_is_about_must_lie_in_the_workspace(axis):
    most = ARM.motion.workspace_m[1][axis]
    where = {0: "button_x", 1: "box_y"}[axis]
    check_fit(table(**{where: most}), ARM, "file")
    with pytest.raises(ConfigError, match="within the arm's workspace"):
        check_fit(table(**{where: most + HAIR_M}), ARM, "file")


def test_leaves_that_cannot_be_passed_over_are_refused():
    low = msgspec.structs.replace(ARM, motion=msgspec.structs.replace(ARM.motion, heights_m=(0.025, 0.19)))
    check_fit(table(box_y=0.25), low, "file")
    check_fit(table(box_y=0.25, lid_angle=1.85), ARM, "file")
    with pytest.raises(ConfigError, match="below the fingertips at travel height"):
        check_fit(table(box_y=0.25, lid_angle=1.85), low, "file")


@pytest.mark.parametrize("height_m", [0.4, -0.5])
def test_a_table_that_the_arm_cannot_work_on_is_refused(tmp_path, height_m):
    text = (Path(__file__).parents[2] / "config" / "scenarios" / "paper.yaml").read_text()
    path = tmp_path / "scenario.yaml"
    path.write_text(f"{text}\ntable: {{height_m: {height_m}}}\n")
    with pytest.raises(ConfigError, match=r"table\.height_m"):
        resolve(scenario=path)
