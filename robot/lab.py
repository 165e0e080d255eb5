"""A station whose arm is held by a servo process and whose table is laid out by somebody else on the bus."""

import typer

from config.limited import limited
from config.resolved import Resolved
from config.rig import Rig
from robot.bus import Bus, Role
from robot.bus.errors import BusError, NoHubError
from robot.bus.topics import ARM_STATE
from robot.bus.twin_link import RemoteResetter, RemoteTruth
from robot.errors import RobotConfigError
from robot.hal.pendant import Pendant
from robot.hal.protocols import Resetter, SceneTruth
from robot.local_station import LocalStation
from robot.messages import PlantIdentity
from robot.motion import AskedHand
from robot.node import NodeAsker, RemoteStation
from robot.node.remote_perception import RemotePerception
from robot.person import TerminalPerson
from robot.person_reset import PersonLook
from robot.servo_client import ServoClient
from robot.station_doors import Perceives, Sighted

__all__ = ["LabWorld", "build_lab_station", "button_of", "is_fed", "join_robot_node", "pendant_of"]


AWAY_S = 30.0
"""How long a robot node, or the bus's hub, may be away while it is started anew."""


class LabWorld:
    """The plant as the bus and the servo process know it (robot.local_station.World)."""

    def __init__(self, *, loop: ServoClient, truth: SceneTruth | None, resetter: Resetter) -> None:
        self._loop = loop
        self.truth: SceneTruth | None = truth
        self.resetter = resetter

    @property
    def identity(self) -> PlantIdentity:
        """Which plant the servo process finds; it is started for that, and moves nothing."""
        self._loop.connect()
        assert self._loop.identity is not None, "connecting told it"
        return self._loop.identity


def build_lab_station(resolved: Resolved, perception: Perceives, *, is_driven: bool = False) -> LocalStation:
    """Return the station of a rig with a bus, disarmed; the bus is open, the arm not connected to.

    Args:
        resolved: rig, arm, scenario and rule sets.
        perception: what makes percepts.
        is_driven: a person drives; where a person lays the table out nobody else on the bus is needed then.

    Raises:
        RobotConfigError: the rig names no bus, or its arm is a robot node's to hold.
        BusError: nobody listens at its endpoint.
    """
    rig, arm = resolved.rig, limited(resolved.arm, resolved.profile)
    if rig.bus is None:
        raise RobotConfigError(f"rig {rig.name}: expected the endpoint of its bus, came none")
    if rig.reset == "person":
        if is_driven:
            return _driven_station(resolved, perception)
        raise RobotConfigError(
            f"rig {rig.name}: expected a robot node on its bus, for a person lays the table out at its terminal: start "
            f"`autotelic node robot --rig {rig.name}` (or the rig's file) in a terminal beside the arm"
        )
    if isinstance(perception, Sighted):
        raise RobotConfigError(
            f"rig {rig.name}: expected a robot node and a perception node on its bus, for its camera's pictures go "
            "there and nowhere else: start them with `autotelic up`"
        )
    bus = Bus(
        rig.bus, serial=rig.expected.serial, role=Role.TELEOP if is_driven else Role.LEARNING, keys=rig.keys
    )  # fmt: skip
    bus.open()
    loop = ServoClient(resolved, when_closed=bus.close)
    truth = RemoteTruth(bus)
    resetter = RemoteResetter(bus, loop=loop, truth=truth)
    world = LabWorld(loop=loop, truth=truth, resetter=resetter)
    return LocalStation(
        world=world, loop=loop, perception=perception, arm=arm, scenario=resolved.scenario, rig=rig,
        hand=AskedHand(arm) if is_driven else None, cell_shows=pendant_of(rig), arming_signal=button_of(resolved),
    )  # fmt: skip


def join_robot_node(resolved: Resolved, *, is_driven: bool = False) -> RemoteStation | None:
    """Return the station of the robot node on the rig's bus, disarmed for this process; None where there is none.

    Where a person drives, and lays the table out too, there need be no bus either, unless a process on it perceives.

    Args:
        resolved: the rig, and the table that is expected there.
        is_driven: a person drives.

    Raises:
        BusError: nobody listens at the bus's endpoint, or there is a robot node that does not answer; or there is none,
            on a rig whose table a person lays out: he may be at it.
        RobotConfigError: the robot node has another table, or holds other limits.
    """
    rig = resolved.rig
    if rig.bus is None:
        return None
    bus = Bus(rig.bus, serial=rig.expected.serial, role=Role.TELEOP if is_driven else Role.LEARNING, keys=rig.keys)
    try:
        bus.open()
    except NoHubError:
        if is_driven and rig.reset == "person" and not is_fed(rig):
            return None  # nothing else of the rig runs: who drives holds the arm himself
        raise
    try:
        asker = NodeAsker(bus, wait_s=AWAY_S, tell=lambda line: typer.echo(line, err=True))
        if not asker.is_anybody():
            if is_driven:
                _require_nobody_at_table(rig)
            bus.close()
            return None
        station = RemoteStation(bus, asker=asker, is_driven=is_driven)
        station.expect(scenario=resolved.scenario.name, profile=rig.profile)
    except BaseException:
        bus.close()
        raise
    return station


def _require_nobody_at_table(rig: Rig) -> None:
    """Raise BusError where a person may be at the table, at the word of a robot node that stands still."""
    if rig.reset == "person":
        raise BusError(
            f"robot node: expected the one that holds the arm of {rig.name} to answer at {rig.bus}, none did; "
            "start `autotelic node robot` in a terminal beside the arm, or see why it stands still"
        )


def _driven_station(resolved: Resolved, perception: Perceives) -> LocalStation:
    """Return the station of an arm that a person drives and whose table a person sees to."""
    rig, arm = resolved.rig, limited(resolved.arm, resolved.profile)
    bus = None if rig.bus is None or not is_fed(rig) else _robots_bus(rig, rig.bus)
    loop = ServoClient(resolved) if bus is None else ServoClient(resolved, when_closed=bus.close)
    if bus is not None:
        perception = RemotePerception(bus, resolved.scenario, tell=bus.publisher(ARM_STATE).put, measure=loop.measure)
    world = LabWorld(loop=loop, truth=None, resetter=PersonLook(loop=loop, person=TerminalPerson()))
    return LocalStation(
        world=world, loop=loop, perception=perception, arm=arm, scenario=resolved.scenario, rig=rig,
        hand=AskedHand(arm), cell_shows=pendant_of(rig), arming_signal=button_of(resolved),
    )  # fmt: skip


def _robots_bus(rig: Rig, endpoint: str) -> Bus:
    """Return the bus, open, for the process that holds the arm: its measurements are what a perception node answers."""
    bus = Bus(endpoint, serial=rig.expected.serial, role=Role.ROBOT, keys=rig.keys)
    bus.open()
    return bus


def is_fed(rig: Rig) -> bool:
    """Tell whether a process of its own perceives on a rig."""
    return any(node.kind == "perception" for node in rig.nodes)


def pendant_of(rig: Rig) -> Pendant | None:
    """Return where a code for arming is shown: on a real arm's pendant. A virtual one has none that anybody sees."""
    return Pendant(rig.address) if rig.address is not None and rig.expected.kind == "real" else None


def button_of(resolved: Resolved) -> int | None:
    """Return the input of the cell's arming button, None where it has none."""
    return None if resolved.cell is None else resolved.cell.arming_signal
