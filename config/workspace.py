"""Where the arm may move over one table: a scenario may fence off part of what the arm's file allows."""

import msgspec

from config.arm import ArmConfig
from config.errors import ConfigError
from config.scenario import Scenario

__all__ = ["fenced"]

ROUNDING_M = 1e-9


def fenced(arm: ArmConfig, scenario: Scenario, file: str) -> ArmConfig:
    """Return the arm with its workspace cut to the scenario's, base frame; the same arm where that names none.

    Raises:
        ConfigError: the table is too high or too low for the arm, or the scenario's workspace reaches beyond the arm's
            or leaves out a height that the tool must come to.
    """
    _check_table(arm, scenario, file)
    if scenario.workspace_m is None:
        return arm
    (low, high), (arm_low, arm_high) = scenario.workspace_m, arm.motion.workspace_m
    for axis in range(3):
        least, most = arm_low[axis], arm_high[axis]
        for corner, at in enumerate((low[axis], high[axis])):
            if not least <= at <= most:
                expected = f"within the arm's workspace, {least:g} to {most:g}"
                raise ConfigError(file, f"workspace_m[{corner}][{axis}]", expected, f"{at:g}")
    lowest, travel = (scenario.table.height_m + height for height in arm.motion.heights_m)
    if low[2] > lowest + ROUNDING_M:
        expected = f"{arm_low[2]:g} to {lowest:g}, the tool's lowest height over this table"
        raise ConfigError(file, "workspace_m[0][2]", expected, f"{low[2]:g}")
    if high[2] < travel - ROUNDING_M:
        expected = f"{travel:g}, the tool's travel height over this table, to {arm_high[2]:g}"
        raise ConfigError(file, "workspace_m[1][2]", expected, f"{high[2]:g}")
    motion = msgspec.structs.replace(arm.motion, workspace_m=scenario.workspace_m)
    return msgspec.structs.replace(arm, motion=motion)


def _check_table(arm: ArmConfig, scenario: Scenario, file: str) -> None:
    (low, high), (lowest_m, travel_m) = arm.motion.workspace_m, arm.motion.heights_m
    least, most = low[2] - lowest_m, high[2] - travel_m
    if not least - ROUNDING_M <= scenario.table.height_m <= most + ROUNDING_M:
        expected = f"{least:g} to {most:g}, so that the arm reaches down to the table and clears it"
        raise ConfigError(file, "table.height_m", expected, f"{scenario.table.height_m:g}")
