"""Picks by a hand-written pilot: down on a cylinder in its box, up, across the table at top speed, a hard stop."""

import math

import msgspec
import mujoco
import numpy as np

from robot.local_station import LocalStation
from sim_twin.names import on_table
from sim_twin.pilot import Pilot
from sim_twin.plant import TwinPlant

__all__ = ["FIRST_SEED", "OFF_CENTRE_M", "Pick", "pick_all", "pick_off_centre"]

FIRST_SEED = 200
"""Tables of seeds below this were looked at while contacts were chosen: none of them is reported."""
OFF_CENTRE_M = 0.02
"""How far beside an object's centre the tool comes down at most, along either axis of the table."""
HELD_WITHIN_M = 0.03


class Pick(msgspec.Struct, frozen=True):
    """One pick: was it ever held, was it held to the end, how far did it slip, and was a drop seen."""

    was_held: bool
    is_held: bool
    slip_m: float
    is_reported_held: bool


def pick_all(station: LocalStation, plant: TwinPlant, n: int) -> list[Pick]:
    """Pick the boxed cylinders in turn, each at a newly drawn place and turn, lid open, the tool over its centre."""
    return _pick_each(station, plant, np.zeros((n, 2)))


def pick_off_centre(station: LocalStation, plant: TwinPlant, n: int) -> list[Pick]:
    """Do the same with the tool beside the centre, by amounts drawn evenly; how many are asked changes none of them."""
    rng = np.random.default_rng([FIRST_SEED, 1])
    return _pick_each(station, plant, rng.uniform(-OFF_CENTRE_M, OFF_CENTRE_M, (n, 2)))


def _pick_each(station: LocalStation, plant: TwinPlant, offsets_m: np.ndarray) -> list[Pick]:
    """Pick once for each displacement of the tool in the plane.  (n, 2), table's axes"""
    last_epoch = plant.world.scenario.schedule[-1].from_epoch
    pilot = Pilot(station)
    names = [c.name for c in plant.world.scenario.cylinders if c.inside is not None]
    picks = []
    for k, (dx, dy) in enumerate(offsets_m.tolist()):
        pilot.reset(seed=FIRST_SEED + k, epoch=last_epoch)
        name = names[k % len(names)]
        picks.append(_pick(pilot, plant, name, off_m=(dx, dy), side=1 if k % 4 < 2 else -1))
    return picks


def _pick(pilot: Pilot, plant: TwinPlant, name: str, *, off_m: tuple[float, float], side: int) -> Pick:
    """Go down on one or beside it, lift it, carry it across the table at top speed and stop while moving."""
    x, y, _ = pilot.where(name)
    pilot.go(x + off_m[0], y + off_m[1])
    pilot.rest()
    was_held = pilot.down(lambda r: r.percept.grip.has_object)
    pilot.rest(4)
    start = _in_hand(plant, name)
    for _ in range(14):
        pilot.step()
    heading = math.atan2(-y, 0.42 - x) if side > 0 else math.atan2(-y, 0.36 - x)
    for _ in range(12):
        pilot.step(heading_rad=heading, distance_m=0.022)
    plant.arm.stop()
    for _ in range(60):
        plant.arm.clock.wait_tick()
    end = _in_hand(plant, name)
    is_held = bool(np.linalg.norm(end) < HELD_WITHIN_M)
    return Pick(was_held, is_held, float(np.linalg.norm(end - start)), plant.arm.read().grip.has_object)


def _in_hand(plant: TwinPlant, name: str) -> np.ndarray:
    """Return an object's position in the tool's frame, from the physics.  (3,)"""
    data = plant.world.data
    mujoco.mj_kinematics(plant.world.model, data)
    tcp = data.site("tcp")
    return tcp.xmat.reshape(3, 3).T @ (data.body(on_table(name)).xpos - tcp.xpos)
