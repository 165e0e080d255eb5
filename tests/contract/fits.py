"""What implements which door: the type checker proves each line."""

from perception.cameras import FolderCamera
from perception.ground_truth import GroundTruthPerception
from perception.percept import Perception
from robot.clock import LockStepClock
from robot.hal.fake import FakeArm, FakePlant
from robot.hal.protocols import Arm, Camera, Clock, Plant
from robot.hal.rtde import RtdeArm
from robot.hal.rtde_clock import RtdeClock
from robot.hal.rtde_plant import RtdePlant
from robot.hal.sight import Observer, Watched
from robot.hal.ur_observer import UrObserver
from robot.local_station import LocalStation
from robot.node import RemoteStation
from robot.node.served import ServedStation
from robot.person import Person, PersonOperator, TerminalPerson
from robot.safety import Armable, Operator
from robot.station import Station
from robot.station_doors import Perceives
from robot.teleop import Device, DrivenStation
from robot.teleop.attending import Attendant, NobodyAsked, TerminalAttendant
from robot.teleop.driver import Pace, Unpaced
from robot.teleop.gamepad import Gamepad
from robot.teleop.keyboard import Keyboard
from robot.teleop.pace import WallPace
from robot.teleop.script import ScriptedDevice
from robot.teleop.spacemouse import SpaceMouse
from sim_twin.operator import SimulatedOperator
from sim_twin.plant import TwinArm, TwinPlant
from sim_twin.rendered_camera import RenderedCamera

__all__ = [
    "ARMABLES",
    "ARMS",
    "ATTENDANTS",
    "CAMERAS",
    "CLOCKS",
    "DEVICES",
    "DRIVEN",
    "OBSERVERS",
    "OPERATORS",
    "PACES",
    "PERCEIVERS",
    "PERCEPTIONS",
    "PERSONS",
    "PLANTS",
    "SERVED",
    "STATIONS",
    "WATCHED",
]

PLANTS: tuple[type[Plant], ...] = (FakePlant, TwinPlant, RtdePlant)
ARMS: tuple[type[Arm], ...] = (FakeArm, TwinArm, RtdeArm)
OBSERVERS: tuple[type[Observer], ...] = (UrObserver,)
WATCHED: tuple[type[Watched], ...] = (RtdePlant,)
ATTENDANTS: tuple[type[Attendant], ...] = (TerminalAttendant, NobodyAsked)
CAMERAS: tuple[type[Camera], ...] = (FolderCamera, RenderedCamera)
CLOCKS: tuple[type[Clock], ...] = (LockStepClock, RtdeClock)
STATIONS: tuple[type[Station], ...] = (LocalStation, RemoteStation)
SERVED: tuple[type[ServedStation], ...] = (LocalStation,)
ARMABLES: tuple[type[Armable], ...] = (LocalStation, RemoteStation)
OPERATORS: tuple[type[Operator], ...] = (SimulatedOperator, PersonOperator)
PERSONS: tuple[type[Person], ...] = (TerminalPerson,)
DEVICES: tuple[type[Device], ...] = (Keyboard, Gamepad, SpaceMouse, ScriptedDevice)
DRIVEN: tuple[type[DrivenStation], ...] = (LocalStation, RemoteStation)
PACES: tuple[type[Pace], ...] = (Unpaced, WallPace)
PERCEPTIONS: tuple[type[Perception], ...] = (GroundTruthPerception,)
PERCEIVERS: tuple[type[Perceives], ...] = (GroundTruthPerception,)
