"""The robot node of a rig: its arm by a servo process, its table laid out by somebody else. Put together.

Who lays it out is the twin's process on the bus, or a person at this process's own terminal.
"""

from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from time import sleep
from typing import TypeVar

import typer

from config.limited import limited
from config.resolved import Resolved
from robot.bus import Bus, Role
from robot.bus.topics import TICKS
from robot.bus.twin_link import RemoteResetter, RemoteTruth
from robot.errors import RobotConfigError
from robot.hal.protocols import Resetter, SceneTruth
from robot.lab import LabWorld, button_of, is_fed, pendant_of
from robot.local_station import LocalStation
from robot.motion import AskedHand, HandReflexes
from robot.node.pulse import HealthTeller
from robot.node.remote_perception import RemotePerception
from robot.node.robot_node import RobotNode
from robot.person import PersonOperator, TerminalPerson
from robot.person_reset import PersonResetter
from robot.person_station import PersonResetStation
from robot.person_table import PerceivedTable
from robot.rigs import build_operator, build_perception, check_usable
from robot.servo_client import ServoClient
from robot.station_doors import Perceives
from robot.ticks_told import TickTeller

__all__ = ["open_robot_node"]

S = TypeVar("S", bound=LocalStation)


@contextmanager
def open_robot_node(resolved: Resolved, *, pictures: Path = Path("resets")) -> Generator[RobotNode]:
    """Put a rig's robot node together, on its bus; its arm is connected to when somebody asks, and never armed here.

    Where the rig's operator is a person, or one lays the table out, that is whoever sits at this process's terminal.

    Args:
        resolved: rig, arm, scenario and rule sets.
        pictures: folder for what a person who lays the table out needs to see.

    Raises:
        RobotConfigError: the rig has no bus.
        WireError: nobody listens at its endpoint, or another process of this machine holds the arm.
    """
    rig, arm = resolved.rig, limited(resolved.arm, resolved.profile)
    check_usable(rig)
    if rig.bus is None:
        raise RobotConfigError(f"rig {rig.name}: expected the endpoint of its bus, came none: its processes are one")
    with ExitStack() as stack:
        bus = stack.enter_context(Bus(rig.bus, serial=rig.expected.serial, role=Role.ROBOT, keys=rig.keys))
        loop = ServoClient(resolved)
        loop.hold()
        stack.callback(loop.close)
        node: RobotNode
        perception: Perceives = (
            RemotePerception(
                bus,
                resolved.scenario,
                tell=lambda state: node.tell_measured(state),
                measure=loop.measure,
                gives_up=lambda: node.is_stop_due,
            )
            if is_fed(rig)
            else build_perception(resolved)
        )

        def tend() -> None:
            node.tend()  # made below, of what calls this

        station = _station_of(resolved, bus, loop, perception, tend=tend, pictures=pictures)

        def drive(is_driven: bool) -> None:
            station.give_hand(AskedHand(arm) if is_driven else HandReflexes(arm=arm, scenario=resolved.scenario))

        is_armed_by_person = isinstance(build_operator(rig), PersonOperator)
        node = RobotNode(
            bus,
            station,
            scenario=resolved.scenario.name,
            profile=rig.profile,
            drive=drive,
            halt=loop.halt,
            end_halt=loop.end_halt,
            say=lambda text: typer.echo(text, err=True),
            take_notes=loop.take_notes,
            is_perceiving=not is_fed(rig),
            is_attended=is_armed_by_person or rig.reset == "person",
            person=_operator(tend) if is_armed_by_person else None,
        )
        ticks = bus.publisher(TICKS)
        stack.callback(TickTeller(loop.ticks, put=ticks.put, is_read=lambda: ticks.is_read).close)
        stack.callback(node.close)
        stack.callback(HealthTeller(bus, node.pulse).close)
        yield node


def _operator(tend: Callable[[], None]) -> PersonOperator:
    """Return the person at the terminal, as who arms; the node is tended while he reads and types."""

    def wait(seconds: float) -> None:
        tend()
        sleep(seconds)

    return PersonOperator(TerminalPerson(tend), wait=wait)


def _station_of(
    resolved: Resolved, bus: Bus, loop: ServoClient, perception: Perceives, *, tend: Callable[[], None], pictures: Path
) -> LocalStation:
    """Return the station: of a table that the twin's process lays out, or a person."""
    rig = resolved.rig
    if rig.reset == "twin":
        truth = RemoteTruth(bus)
        return _station(LocalStation, resolved, loop, perception, truth, RemoteResetter(bus, loop=loop, truth=truth))
    truth = None if is_fed(rig) else RemoteTruth(bus)
    table = PerceivedTable(perception, loop, truth=truth, meanwhile=tend)
    by_person = PersonResetter(
        scenario=resolved.scenario, loop=loop, scene=table, person=TerminalPerson(tend), pictures=pictures
    )
    station = _station(PersonResetStation, resolved, loop, perception, truth, by_person)
    station.prepare(by_person, rig.parked_rad or resolved.arm.home_rad, meanwhile=tend)
    return station


def _station(
    kind: type[S], resolved: Resolved, loop: ServoClient, perception: Perceives, truth: SceneTruth | None,
    resetter: Resetter,
) -> S:  # fmt: skip
    rig = resolved.rig
    return kind(
        world=LabWorld(loop=loop, truth=truth, resetter=resetter), loop=loop, perception=perception,
        arm=limited(resolved.arm, resolved.profile), scenario=resolved.scenario, rig=rig, cell_shows=pendant_of(rig),
        arming_signal=button_of(resolved),
    )  # fmt: skip
