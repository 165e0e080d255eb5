"""Whether a scenario's things fit: on the table, beside one another, in their boxes, in the hand, under the arm."""

import itertools
import math

from config.arm import ArmConfig
from config.checks import RESERVED_NAMES
from config.errors import ConfigError
from config.footprints import (
    Footprint,
    clearance_m,
    footprint_of_box,
    footprint_of_button,
    footprint_of_cylinder,
    leaf_length_m,
)
from config.scenario import Box, Cylinder, Scenario

__all__ = ["check_fit", "check_placing"]

ROUNDING_M = 1e-9
LID_SLACK_M = 0.002
"""What stands in a box must be lower than a lid that shuts over it by at least this."""
JAW_SLACK_M = 0.005
"""The open jaws must be wider than what they take by at least this on either side."""


def check_placing(scenario: Scenario, file: str) -> None:
    """Check that things stand on the table, do not overlap in any draw, and that cylinders fit their boxes.

    Raises:
        ConfigError: naming the thing that does not fit and by how much.
    """
    standing = [(f"buttons[{i}]", footprint_of_button(button)) for i, button in enumerate(scenario.buttons)]
    standing += [(f"boxes[{i}]", footprint_of_box(box, with_leaves=False)) for i, box in enumerate(scenario.boxes)]
    loose = [(i, cylinder) for i, cylinder in enumerate(scenario.cylinders) if cylinder.inside is None]
    standing += [(f"cylinders[{i}]", footprint_of_cylinder(cylinder)) for i, cylinder in loose]
    for where, footprint in standing:
        _check_on_table(scenario, footprint, where, file)
    for pair in itertools.combinations(standing, 2):
        _check_apart(*pair, file)
    leaves = [(f"boxes[{i}]", footprint_of_box(box, with_leaves=True)) for i, box in enumerate(scenario.boxes)]
    for pair in itertools.combinations(leaves, 2):
        _check_apart(*pair, file)
    _check_inside(scenario, file)


def check_fit(scenario: Scenario, arm: ArmConfig, file: str) -> None:
    """Check that an arm with its hand can do what a scenario's goals ask.

    Raises:
        ConfigError: naming the thing that is out of reach, too wide, too low or too high.
    """
    _check_names(scenario, arm, file)
    _check_start(scenario, arm, file)
    asked = {name for goal in scenario.goals for name in (goal.object, goal.box) if name is not None}
    for i, button in enumerate(scenario.buttons):
        if button.name in asked:
            _check_reach(arm, button.position_m, button.spread_m, f"buttons[{i}].position_m", file)
        _check_pressable(scenario, arm, i, file)
    for i, cylinder in enumerate(scenario.cylinders):
        if cylinder.name in asked:
            _check_grasp(scenario, arm, i, cylinder, file)
    for i, box in enumerate(scenario.boxes):
        if box.name in asked:
            _check_reach(arm, box.position_m, box.spread_m, f"boxes[{i}].position_m", file)
        _check_passable(arm, i, box, file)
    _check_start_clear(scenario, arm, file)


def _check_on_table(scenario: Scenario, footprint: Footprint, where: str, file: str) -> None:
    x0, y0, x1, y1 = footprint.region_m()
    (cx, cy), (lx, ly) = scenario.table.centre_m, scenario.table.size_m
    beyond_m = max(cx - lx / 2 - x0, cy - ly / 2 - y0, x1 - cx - lx / 2, y1 - cy - ly / 2)
    if beyond_m > ROUNDING_M:
        raise ConfigError(
            file, f"{where}.position_m", "a place on the table in every draw", f"{_mm(beyond_m)} beyond it"
        )


def _check_apart(first: tuple[str, Footprint], second: tuple[str, Footprint], file: str) -> None:
    gap_m = clearance_m(first[1], second[1])
    if gap_m < -ROUNDING_M:
        expected = f"a place clear of {first[0]} in every draw, walls and open lids counted"
        raise ConfigError(file, f"{second[0]}.position_m", expected, f"an overlap of {_mm(-gap_m)}")


def _check_inside(scenario: Scenario, file: str) -> None:
    """Check each cylinder against its box, and cylinders of one box against one another."""
    boxes = {box.name: box for box in scenario.boxes}
    inside = [(i, cylinder, boxes[cylinder.inside]) for i, cylinder in enumerate(scenario.cylinders) if cylinder.inside]
    for i, cylinder, box in inside:
        x0, y0, x1, y1 = footprint_of_cylinder(cylinder).region_m()
        beyond_m = max(max(-x0, x1) - box.inner_m[0] / 2, max(-y0, y1) - box.inner_m[1] / 2)
        if beyond_m > ROUNDING_M:
            expected = f"a place within {box.name} in every draw"
            raise ConfigError(file, f"cylinders[{i}].position_m", expected, f"{_mm(beyond_m)} beyond its inside")
    for i, cylinder in enumerate(scenario.cylinders):
        for name in (cylinder.inside, cylinder.receptacle):
            _check_under_lid(i, cylinder, boxes.get(name or ""), file)
    for (i, a, box_a), (k, b, box_b) in itertools.combinations(inside, 2):
        if box_a is box_b:
            _check_apart(
                (f"cylinders[{i}]", footprint_of_cylinder(a)), (f"cylinders[{k}]", footprint_of_cylinder(b)), file
            )


def _check_under_lid(i: int, cylinder: Cylinder, box: Box | None, file: str) -> None:
    if box is None or box.lid is None:
        return
    most_m = box.height_m - LID_SLACK_M
    if cylinder.height_m > most_m + ROUNDING_M:
        expected = f"at most {most_m:g}, so that the lid of {box.name} shuts over it"
        raise ConfigError(file, f"cylinders[{i}].height_m", expected, f"{cylinder.height_m:g}")


def _check_names(scenario: Scenario, arm: ArmConfig, file: str) -> None:
    taken = {joint.name for joint in arm.joints} - set(RESERVED_NAMES)
    groups = {"buttons": scenario.buttons, "boxes": scenario.boxes, "cylinders": scenario.cylinders}
    for group, things in groups.items():
        for i, thing in enumerate(things):
            if thing.name in taken:
                raise ConfigError(file, f"{group}[{i}].name", "a name that no joint of the arm has", thing.name)


def _check_start(scenario: Scenario, arm: ArmConfig, file: str) -> None:
    low, high = arm.motion.workspace_m
    for axis in range(3):
        centre, spread = scenario.start.position_m[axis], scenario.start.spread_m[axis]
        least, most = low[axis], high[axis]
        if centre - spread < least - ROUNDING_M or centre + spread > most + ROUNDING_M:
            expected = f"with its spread within the arm's workspace, {least:g} to {most:g}"
            raise ConfigError(file, f"start.position_m[{axis}]", expected, f"{centre:g} ± {spread:g}")


def _check_start_clear(scenario: Scenario, arm: ArmConfig, file: str) -> None:
    """The open hand must begin above whatever it may stand over, upright lids counted."""
    start, tool = scenario.start, arm.tool
    hand = Footprint(
        centre_m=start.position_m[:2],
        spread_m=start.spread_m[:2],
        radius_m=math.hypot(tool.stroke_m / 2 + tool.pad_size_m[0], tool.pad_size_m[1] / 2),
    )
    things = [(button.name, footprint_of_button(button), button.height_m) for button in scenario.buttons]
    things += [(box.name, footprint_of_box(box, with_leaves=True), _top_m(box)) for box in scenario.boxes]
    loose = [cylinder for cylinder in scenario.cylinders if cylinder.inside is None]
    things += [(cylinder.name, footprint_of_cylinder(cylinder), cylinder.height_m) for cylinder in loose]
    for name, footprint, top_m in things:
        least_m = scenario.table.height_m + top_m + tool.tip_below_tcp_m + start.spread_m[2]
        if start.position_m[2] <= least_m and clearance_m(hand, footprint) < -ROUNDING_M:
            expected = f"more than {least_m:g}, so that the fingertips begin above {name}"
            raise ConfigError(file, "start.position_m[2]", expected, f"{start.position_m[2]:g}")


def _check_reach(
    arm: ArmConfig, centre_m: tuple[float, float], spread_m: tuple[float, float], where: str, file: str
) -> None:
    low, high = arm.motion.workspace_m
    for axis in range(2):
        if not low[axis] <= centre_m[axis] - spread_m[axis] <= centre_m[axis] + spread_m[axis] <= high[axis]:
            expected = f"with its spread within the arm's workspace, {low[axis]:g} to {high[axis]:g}"
            raise ConfigError(file, f"{where}[{axis}]", expected, f"{centre_m[axis]:g} ± {spread_m[axis]:g}")
    longest_m = abs(arm.joints[1].a_m) + abs(arm.joints[2].a_m)
    farthest_m = math.hypot(*(abs(centre_m[i]) + spread_m[i] for i in range(2)))
    if farthest_m > longest_m:
        raise ConfigError(file, where, f"within the arm's length, {longest_m:g}", f"{farthest_m:g}")


def _check_pressable(scenario: Scenario, arm: ArmConfig, i: int, file: str) -> None:
    """The fingertips at the lowest height must be below where the cap ends its travel."""
    button = scenario.buttons[i]
    tip_m = arm.motion.heights_m[0] - arm.tool.tip_below_tcp_m
    if button.height_m - button.travel_m <= tip_m:
        expected = f"more than {tip_m + button.travel_m:g}, so that the fingertips can press it down"
        raise ConfigError(file, f"buttons[{i}].height_m", expected, f"{button.height_m:g}")


def _check_grasp(scenario: Scenario, arm: ArmConfig, i: int, cylinder: Cylinder, file: str) -> None:
    most_m = arm.tool.stroke_m - 2 * JAW_SLACK_M
    if cylinder.diameter_m > most_m:
        expected = f"at most {most_m:g}, what the open jaws take with {_mm(JAW_SLACK_M)} to spare on either side"
        raise ConfigError(file, f"cylinders[{i}].diameter_m", expected, f"{cylinder.diameter_m:g}")
    if cylinder.height_m <= arm.motion.heights_m[0]:
        expected = f"more than the tool's lowest height, {arm.motion.heights_m[0]:g}"
        raise ConfigError(file, f"cylinders[{i}].height_m", expected, f"{cylinder.height_m:g}")
    box = next((box for box in scenario.boxes if box.name == cylinder.inside), None)
    if box is None:
        _check_reach(arm, cylinder.position_m, cylinder.spread_m, f"cylinders[{i}].position_m", file)
        return
    x, y = (box.position_m[axis] + cylinder.position_m[axis] for axis in range(2))
    spread_m = (box.spread_m[0] + cylinder.spread_m[0], box.spread_m[1] + cylinder.spread_m[1])
    _check_reach(arm, (x, y), spread_m, f"cylinders[{i}].position_m", file)
    _check_room_for_hand(arm, i, cylinder, box, file)


def _check_room_for_hand(arm: ArmConfig, i: int, cylinder: Cylinder, box: Box, file: str) -> None:
    """The open hand, centred on the cylinder wherever it is drawn, must go down between the walls."""
    jaws_m = arm.tool.stroke_m / 2 + arm.tool.pad_size_m[0]
    across_m = arm.tool.pad_size_m[1] / 2
    turn = arm.tool_yaw_rad
    half_m = (
        abs(jaws_m * math.sin(turn)) + abs(across_m * math.cos(turn)),
        abs(jaws_m * math.cos(turn)) + abs(across_m * math.sin(turn)),
    )
    for axis in range(2):
        room_m = box.inner_m[axis] / 2 - half_m[axis] - abs(cylinder.position_m[axis])
        if cylinder.spread_m[axis] > room_m + ROUNDING_M:
            expected = f"at most {max(room_m, 0.0):g}, so that the open hand finds room between the walls of {box.name}"
            raise ConfigError(file, f"cylinders[{i}].spread_m[{axis}]", expected, f"{cylinder.spread_m[axis]:g}")


def _check_passable(arm: ArmConfig, i: int, box: Box, file: str) -> None:
    """At travel height the fingertips must pass over a box's rim and over its upright leaves."""
    top_m = _top_m(box)
    tip_m = arm.motion.heights_m[1] - arm.tool.tip_below_tcp_m
    if top_m >= tip_m:
        expected = f"below the fingertips at travel height, {tip_m:g}, open lid counted"
        raise ConfigError(file, f"boxes[{i}].height_m", expected, f"{top_m:g}")


def _top_m(box: Box) -> float:
    """Return how high a box comes above the table, its leaves at their highest."""
    if box.lid is None:
        return box.height_m
    return box.height_m + leaf_length_m(box) * math.sin(min(box.lid.open_angle_rad, math.pi / 2))


def _mm(length_m: float) -> str:
    return f"{length_m * 1000:.3g} mm"
