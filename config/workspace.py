"""Where the arm may move over one table: a scenario may fence off part of what the arm's file allows."""

import msgspec

from config.arm import ArmConfig
from config.errors import ConfigError
from config.scenario import Scenario

__all__ = ["fenced"]


def fenced(arm: ArmConfig, scenario: Scenario, file: str) -> ArmConfig:
    """Return the arm with its workspace cut to the scenario's, base frame; the same arm where that names none.

    Raises:
        ConfigError: the scenario's workspace reaches beyond the arm's.
    """
    if scenario.workspace_m is None:
        return arm
    (low, high), (arm_low, arm_high) = scenario.workspace_m, arm.motion.workspace_m
    for axis in range(3):
        least, most = arm_low[axis], arm_high[axis]
        for corner, at in enumerate((low[axis], high[axis])):
            if not least <= at <= most:
                expected = f"within the arm's workspace, {least:g} to {most:g}"
                raise ConfigError(file, f"workspace_m[{corner}][{axis}]", expected, f"{at:g}")
    motion = msgspec.structs.replace(arm.motion, workspace_m=scenario.workspace_m)
    return msgspec.structs.replace(arm, motion=motion)
