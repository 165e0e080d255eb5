"""What is on the table in a photograph: drawn from a seed, placed without physics."""

import mujoco
import numpy as np

from config.scenario import Box, Button, Cylinder
from robot.kinematics import Kinematics
from robot.layout import draw_layout
from sim_twin.names import on_table
from sim_twin.plant import TwinWorld

__all__ = ["stage", "stage_sample"]

ON_TABLE_SHARE, LYING_SHARE, LIT_SHARE, OPEN_SHARE = 0.6, 0.5, 0.5, 0.5
TOOL_HEIGHTS_M = (0.10, 0.28)
APART_M = 0.02
N_TRIES = 200
WORKSPACE_M = ((0.24, -0.40, 0.0), (0.64, 0.40, 0.3))
"""Where nothing else is said."""
PARKED_M = (0.25, 0.0, 0.31)


def stage(world: TwinWorld, kinematics: Kinematics, rng: np.random.Generator) -> None:
    """Draw a whole table: layout, lamps, lids, cylinders in boxes, standing and lying, and an arm over it."""
    scenario = world.scenario
    layout = draw_layout(scenario, rng)
    out = sum(1 << b.lamp_output for b in scenario.buttons if rng.uniform() < LIT_SHARE)
    out |= sum(1 << b.lid.output for b in scenario.boxes if b.lid is not None and rng.uniform() < OPEN_SHARE)
    low, high = scenario.workspace_m or WORKSPACE_M
    x, y = rng.uniform(low[:2], high[:2]).tolist()
    tool = (x, y, float(rng.uniform(*TOOL_HEIGHTS_M)))
    world.put(layout, kinematics.solve(tool, world.arm.home_rad), out)
    taken = [(*layout.fixtures_m[e.name], _reach(e)) for e in (*scenario.buttons, *scenario.boxes)]
    for cylinder in scenario.cylinders:
        if rng.uniform() < ON_TABLE_SHARE:
            _lay_free(world, cylinder, taken, (low[:2], high[:2]), rng)
    mujoco.mj_forward(world.model, world.data)


def stage_sample(world: TwinWorld, kinematics: Kinematics, seed: int, *, is_lit: bool) -> None:
    """Lay out a table for the guided sample, the arm drawn back: lamps lit and lids shut, or neither."""
    scenario = world.scenario
    if is_lit:
        out = sum(1 << b.lamp_output for b in scenario.buttons)
    else:
        out = sum(1 << b.lid.output for b in scenario.boxes if b.lid is not None)
    layout = draw_layout(scenario, np.random.default_rng(seed))
    world.put(layout, kinematics.solve(PARKED_M, world.arm.home_rad), out)


def _lay_free(
    world: TwinWorld, cylinder: Cylinder, taken: list[tuple[float, float, float]],
    corners: tuple[tuple[float, ...], tuple[float, ...]], rng: np.random.Generator,
) -> None:  # fmt: skip
    """Put a cylinder onto free table, standing or lying; where none is found it stays in its place."""
    is_lying = rng.uniform() < LYING_SHARE
    reach = float(np.hypot(cylinder.diameter_m, cylinder.height_m)) / 2.0
    for _ in range(N_TRIES):
        x, y = rng.uniform(*corners).tolist()
        if all(np.hypot(x - u, y - v) > reach + r + APART_M for u, v, r in taken):
            break
    else:
        return
    taken.append((x, y, reach))
    turn = float(rng.uniform(-np.pi, np.pi))
    address = int(world.model.joint(on_table(cylinder.name)).qposadr[0])
    height = (cylinder.diameter_m if is_lying else cylinder.height_m) / 2.0
    world.data.qpos[address : address + 3] = (x, y, world.scenario.table.height_m + height)
    about_z = np.array([np.cos(turn / 2), 0.0, 0.0, np.sin(turn / 2)])
    tipped = np.array([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0]) if is_lying else np.array([1.0, 0.0, 0.0, 0.0])
    quat = np.zeros(4)
    mujoco.mju_mulQuat(quat, about_z, tipped)
    world.data.qpos[address + 3 : address + 7] = quat


def _reach(thing: Button | Box) -> float:
    """Return how far a fixture's edge is from its middle at most."""
    if isinstance(thing, Button):
        return thing.diameter_m / 2.0
    return float(np.hypot(thing.inner_m[0] / 2 + thing.wall_m, thing.inner_m[1] / 2 + thing.wall_m))
