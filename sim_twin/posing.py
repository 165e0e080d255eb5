"""Puts a twin's bodies where an arm was measured and things were perceived: for pictures and shadows, never physics."""

from collections.abc import Sequence

import mujoco

from robot.messages import ArmState, Percept, Quat, Vec3, Vec6
from sim_twin.names import on_table
from sim_twin.plant import TwinWorld

__all__ = ["N_ARM", "N_THING", "pose_world", "posed_numbers", "world_of_numbers"]

N_ARM, N_THING = 8, 7
MOVED_M = 5e-4


def posed_numbers(measured: ArmState, percept: Percept) -> list[float]:
    """Return what is shown as plain numbers: joints, opening, outputs, then place and turn of each thing."""
    numbers = [*measured.q_rad, measured.grip.opening_m, float(measured.digital_out)]
    for thing in percept.objects:
        numbers += [*thing.position_m, *thing.quat]
    return numbers


def world_of_numbers(world: TwinWorld, numbers: Sequence[float]) -> bool:
    """Pose a world by such numbers. Returns whether something moved that a viewer thinks cannot."""
    a, b, c, d, e, f, opening_m, outputs = numbers[:N_ARM]
    names = [thing.name for thing in (*world.scenario.buttons, *world.scenario.boxes, *world.scenario.cylinders)]
    things: dict[str, tuple[Vec3, Quat]] = {}
    for i, name in enumerate(names):
        at = N_ARM + i * N_THING
        x, y, z, qw, qx, qy, qz = numbers[at : at + N_THING]
        if any((qw, qx, qy, qz)):  # otherwise nobody has seen it yet
            things[name] = ((x, y, z), (qw, qx, qy, qz))
    return pose_world(world, q_rad=(a, b, c, d, e, f), opening_m=opening_m, digital_out=int(outputs), things=things)


def pose_world(
    world: TwinWorld,
    *,
    q_rad: Vec6,
    opening_m: float,
    digital_out: int,
    things: dict[str, tuple[Vec3, Quat]],
) -> bool:
    """Pose a world at rest; lids as the outputs have them, things that are not named as they are.

    Returns:
        Whether a fixture was moved.
    """
    model, data, is_moved = world.model, world.data, False
    for fixture in (*world.scenario.buttons, *world.scenario.boxes):
        if fixture.name not in things:
            continue
        place = model.body(on_table(fixture.name)).pos
        x, y, _ = things[fixture.name][0]
        if max(abs(place[0] - x), abs(place[1] - y)) > MOVED_M:
            place[:2] = (x, y)
            is_moved = True
    if is_moved:
        mujoco.mj_resetData(model, data)  # with sleeping on, what cannot move is placed by the reset alone
    for cylinder in world.scenario.cylinders:
        if cylinder.name not in things:
            continue
        address = int(model.joint(on_table(cylinder.name)).qposadr[0])
        position_m, quat = things[cylinder.name]
        data.qpos[address : address + N_THING] = (*position_m, *quat)
    data.qpos[:6] = q_rad
    world.rest_at(q_rad)
    for address in world.finger_addresses:
        data.qpos[address] = opening_m / 2
    data.qvel[:] = 0.0
    world.digital_out = digital_out
    world.table.put(data, digital_out)
    mujoco.mj_forward(model, data)
    return is_moved
