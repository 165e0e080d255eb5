"""The robot node of a rig: its arm by a servo process, its table laid out by somebody else on the bus. Put together."""

from collections.abc import Generator
from contextlib import ExitStack, contextmanager

from config.limited import limited
from config.resolved import Resolved
from robot.bus import Bus, Role
from robot.bus.twin_link import RemoteResetter, RemoteTruth
from robot.errors import RobotConfigError
from robot.lab import LabWorld
from robot.local_station import LocalStation
from robot.motion import AskedHand, HandReflexes
from robot.node.pulse import HealthTeller
from robot.node.remote_perception import RemotePerception
from robot.node.robot_node import RobotNode
from robot.rigs import build_perception, check_usable
from robot.servo_client import ServoClient
from robot.station_doors import Perceives

__all__ = ["open_robot_node"]


@contextmanager
def open_robot_node(resolved: Resolved) -> Generator[RobotNode]:
    """Put a rig's robot node together, on its bus; its arm is connected to when somebody asks, and never armed here.

    Raises:
        RobotConfigError: the rig has no bus, or a person lays its table out.
        BusError: nobody listens at its endpoint.
    """
    rig, arm = resolved.rig, limited(resolved.arm, resolved.profile)
    check_usable(rig)
    if rig.bus is None:
        raise RobotConfigError(f"rig {rig.name}: expected the endpoint of its bus, came none: its processes are one")
    if rig.reset != "twin":
        raise RobotConfigError(
            f"rig {rig.name}: expected a table that the twin lays out; where a person does, whoever commands the arm "
            "holds it himself, at the terminal where that person sits (no robot node yet)"
        )
    is_fed = any(node.kind == "perception" for node in rig.nodes)
    with ExitStack() as stack:
        bus = stack.enter_context(Bus(rig.bus, serial=rig.expected.serial, role=Role.ROBOT, keys=rig.keys))
        loop = ServoClient(resolved)
        truth = RemoteTruth(bus)
        world = LabWorld(loop=loop, truth=truth, resetter=RemoteResetter(bus, loop=loop, truth=truth))
        node: RobotNode
        perception: Perceives = (
            RemotePerception(
                bus,
                resolved.scenario,
                tell=lambda state: node.tell_measured(state),
                gives_up=lambda: node.is_stop_due,
            )
            if is_fed
            else build_perception(resolved)
        )
        station = LocalStation(
            world=world, loop=loop, perception=perception, arm=arm, scenario=resolved.scenario, rig=rig
        )

        def drive(is_driven: bool) -> None:
            station.give_hand(AskedHand(arm) if is_driven else HandReflexes(arm=arm, scenario=resolved.scenario))

        node = RobotNode(
            bus,
            station,
            scenario=resolved.scenario.name,
            profile=rig.profile,
            drive=drive,
            halt=loop.halt,
            take_notes=loop.take_notes,
            is_perceiving=not is_fed,
        )
        stack.callback(node.close)
        stack.callback(HealthTeller(bus, node.pulse).close)
        yield node
