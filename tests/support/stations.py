"""Stations and states for tests of the robot room."""

from functools import cache

import msgspec

from config.loader import resolve
from config.resolved import Resolved
from robot.hal.fake import FakePlant
from robot.local_station import LocalStation
from robot.messages import (
    ArmCommand,
    ArmMode,
    ArmState,
    GripCommand,
    GripState,
    ObjectPercept,
    Percept,
    Vec3,
    Vec6,
)
from robot.rigs import build_station
from sim_twin.operator import SimulatedOperator

__all__ = ["arm_state", "command", "engaged", "fake_rig", "percept"]

TICK_NS = 10_000_000
STILL = GripState(opening_m=0.085, is_moving=False, has_object=False)


@cache
def fake_rig(scenario: str = "paper") -> Resolved:
    """Return the fake rig's files, checked together."""
    return resolve(rig="fake", scenario=scenario, learning="default")


def engaged(resolved: Resolved | None = None, *, seed: int = 1, epoch: int = 0) -> tuple[LocalStation, FakePlant]:
    """Return an engaged station after a reset, and the fake plant under it."""
    resolved = resolved or fake_rig()
    plant = FakePlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
    station = build_station(resolved, plant=plant)
    SimulatedOperator().arm_once(station)
    station.reset(seed=seed, epoch=epoch)
    return station, plant


def arm_state(
    q_rad: Vec6,
    *,
    stamp_ns: int = 0,
    tcp_m: Vec3 = (0.42, 0.0, 0.2),
    force_n: Vec3 = (0.0, 0.0, 0.0),
    speed_m_s: Vec3 = (0.0, 0.0, 0.0),
    qd_rad_s: Vec6 = (0.0,) * 6,
    grip: GripState = STILL,
    digital_in: int = 0,
    digital_out: int = 0,
    mode: ArmMode = ArmMode.RUNNING,
) -> ArmState:
    """Return a measurement, at rest unless said otherwise."""
    return ArmState(
        stamp_ns=stamp_ns,
        q_rad=q_rad,
        qd_rad_s=qd_rad_s,
        tcp_position_m=tcp_m,
        tcp_quat=(0.0, 1.0, 0.0, 0.0),
        tcp_speed_m_s=speed_m_s,
        tcp_force_n=force_n,
        grip=grip,
        digital_in=digital_in,
        digital_out=digital_out,
        mode=mode,
    )


def command(q_rad: Vec6, **changes: object) -> ArmCommand:
    """Return a command that passes from rest at q, with changes."""
    plain = ArmCommand(
        stamp_ns=0,
        sequence=1,
        q_rad=q_rad,
        grip=GripCommand(opening_m=0.085, force_n=20.0, speed_m_s=0.15),
        digital_out=0,
    )
    return msgspec.structs.replace(plain, **changes)


def percept(
    positions_m: dict[str, Vec3],
    *,
    tcp_m: Vec3,
    grip: GripState = STILL,
    stamp_ns: int = 0,
    is_in_contact: bool = False,
) -> Percept:
    """Return a percept of things at places."""
    things = tuple(
        ObjectPercept(name=name, position_m=at, quat=(1.0, 0.0, 0.0, 0.0), age_s=0.0, is_valid=True)
        for name, at in positions_m.items()
    )
    return Percept(
        stamp_ns=stamp_ns,
        distances_m=(),
        button_states=(),
        ages_s=(),
        valid=(),
        objects=things,
        tcp_position_m=tcp_m,
        grip=grip,
        is_in_contact=is_in_contact,
    )
