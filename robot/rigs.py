"""A rig becomes a station: the implementations that its file names are loaded and put together."""

import inspect
from collections.abc import Callable
from importlib import import_module
from time import monotonic_ns
from typing import TYPE_CHECKING, Any

from config.arm import ArmConfig
from config.cell import CellConfig
from config.limited import limited
from config.resolved import Resolved
from config.rig import Rig
from config.scenario import Scenario
from robot.errors import RobotConfigError
from robot.frame_tap import tapped
from robot.hal.protocols import Camera, Plant
from robot.local_station import LocalStation
from robot.motion import AskedHand
from robot.own_senses import OwnSenses
from robot.safety import Operator
from robot.station_doors import Perceives, Sighted
from robot.tick_loop import TickLoop
from robot.tick_tap import TickTap
from robot.timed import time_world

if TYPE_CHECKING:
    from robot.bus import Bus
    from robot.node import RemoteStation
    from robot.teleop.preview import Shadow
    from robot.teleop.view import View

__all__ = [
    "build_camera",
    "build_operator",
    "build_perception",
    "build_plant",
    "build_shadow",
    "build_station",
    "build_view",
    "check_learnable",
    "check_usable",
    "find_station",
    "load",
]


def load(import_string: str) -> Any:  # noqa: ANN401 - what a string names is known only at run time
    """Return what `package.module:Name` names.

    Raises:
        RobotConfigError: there is no such module or name.
    """
    module, _, name = import_string.partition(":")
    try:
        return getattr(import_module(module), name)
    except (ImportError, AttributeError) as error:
        raise RobotConfigError(
            f"expected an import string module:Name that exists, came {import_string!r}: {error}"
        ) from error


def build_plant(*, rig: Rig, arm: ArmConfig, scenario: Scenario, cell: CellConfig | None = None) -> Plant:
    """Return the plant that a rig names, not yet connected."""
    return _make(rig.plant, "plant", arm=arm, scenario=scenario, rig=rig, cell=cell)


def build_station(
    resolved: Resolved,
    *,
    plant: Plant | None = None,
    heard_by: Callable[[str], None] | None = None,
    is_driven: bool = False,
    cell_shows: Callable[[str], None] | None = None,
    host_ns: Callable[[], int] = monotonic_ns,
    tap: TickTap | None = None,
) -> LocalStation:
    """Return the station of a resolved config, disarmed and not yet connected.

    Args:
        resolved: Rig, arm, scenario and rule sets.
        plant: One that is already made, in place of the rig's.
        heard_by: A stopwatch's lap that hears of every tick, where the arm is held in this process.
        is_driven: A person drives: the hand does what it is asked and nothing by itself, and a rig without a perception
            is good enough.
        cell_shows: Shows a text at the cell of an arm that is held in this process; a rig with a bus has its own.
        host_ns: This process's monotonic time, for leases and answers at the cell; never for motion.
        tap: Hears of every tick, where the arm is held in this process, and of every frame, where it is a tap of those.
    """
    rig, arm, scenario = resolved.rig, resolved.arm, resolved.scenario
    check_usable(rig)
    perception = _perception_of(resolved, is_driven=is_driven)
    if rig.bus is not None and plant is None:
        return load("robot.lab:build_lab_station")(
            resolved, perception, is_driven=is_driven
        )  # brings the bus, which lock-step never needs
    world = build_plant(rig=rig, arm=arm, scenario=scenario, cell=resolved.cell) if plant is None else plant
    if heard_by is not None:
        time_world(world, heard_by)
    if isinstance(perception, Sighted):
        perception.watch(tapped(world.cameras, tap))
    loop = TickLoop(
        arm=world.arm, config=arm, scenario=scenario, rule_sets=resolved.rule_sets, rig=rig, profile=resolved.profile,
        tap=tap,
    )  # fmt: skip
    held = limited(arm, resolved.profile)
    return LocalStation(
        world=world, loop=loop, perception=perception, arm=held, scenario=scenario, rig=rig,
        hand=AskedHand(held) if is_driven else None, cell_shows=cell_shows, host_ns=host_ns,
        arming_signal=None if resolved.cell is None else resolved.cell.arming_signal,
    )  # fmt: skip


def find_station(
    resolved: Resolved,
    *,
    heard_by: Callable[[str], None] | None = None,
    is_driven: bool = False,
    tap: TickTap | None = None,
) -> "LocalStation | RemoteStation":
    """Return the station of a rig: of the robot node on its bus where there is one, else one of this process's own.

    Where a person drives, lays the table out too and there is no robot node, it is this process's own, whose terminal
    he sits at. Ticks are tapped in an own one only.
    """
    rig = resolved.rig
    check_usable(rig)
    if rig.bus is not None:
        found = load("robot.lab:join_robot_node")(resolved, is_driven=is_driven)
        if found is not None:
            return found
    return build_station(resolved, heard_by=heard_by, is_driven=is_driven, tap=tap)


def build_perception(resolved: Resolved) -> Perceives:
    """Return what makes percepts on a rig.

    Raises:
        RobotConfigError: it names nothing for it.
    """
    return _perception_of(resolved, is_driven=False)


def _perception_of(resolved: Resolved, *, is_driven: bool) -> Perceives:
    if is_driven and resolved.rig.perception is None:
        return OwnSenses()
    rig = resolved.rig
    return _make(_require_perception(rig), "perception", scenario=resolved.scenario, arm=resolved.arm, rig=rig)


def check_usable(rig: Rig) -> None:
    """Check that a rig whose arm is at an address says which arm is to be found there, and has a bus.

    Without one the arm would be held in the learner's own process, which neither ends when the link is lost nor is
    watched by another.

    Raises:
        RobotConfigError: address or serial are not filled in, or there is an address and no bus.
    """
    if rig.bus is None:
        if rig.address is not None:
            raise RobotConfigError(
                f"rig {rig.name}: expected a bus for the arm at {rig.address}, it has none: an arm on a wire is held "
                "by a process of its own (`bus: tcp/127.0.0.1:7447`, say)"
            )
        return
    missing = [key for key, value in (("address", rig.address), ("expected.serial", rig.expected.serial)) if not value]
    if missing:
        raise RobotConfigError(
            f"rig {rig.name}: expected {' and '.join(missing)} of the arm, not filled in yet: copy the rig's file "
            f"(`autotelic config show --rig {rig.name}` prints it), fill them in and give its path with --rig"
        )


def check_learnable(rig: Rig) -> None:
    """Check, before anything is connected to, that a learner could see what it does on a rig.

    Raises:
        RobotConfigError: address or serial are not filled in, or the rig has no perception.
    """
    check_usable(rig)
    _require_perception(rig)


def _require_perception(rig: Rig) -> str:
    if rig.perception is None:
        raise RobotConfigError(
            f"rig {rig.name}: expected a perception, it has none, and without percepts nothing is learnt: by camera "
            "(`perception.from_camera:CameraPerception`, docs/lab.md). Nothing was connected to, nothing moves"
        )
    return rig.perception


def build_camera(resolved: Resolved, bus: "Bus") -> Camera:
    """Return the camera that a process of its own owns on a rig, not yet connected.

    Args:
        resolved: the rig, and the table that is before its camera.
        bus: open, for a camera of a world that another process holds.

    Raises:
        RobotConfigError: the rig names no camera, or none with a source.
    """
    rig = resolved.rig
    if rig.camera is None or rig.camera.source is None:
        raise RobotConfigError(
            f"rig {rig.name}: expected `camera:` with a source that a process of its own can own, such as "
            "perception.cameras.device:DeviceCamera, came none"
        )
    return _make(rig.camera.source, "camera", scenario=resolved.scenario, arm=resolved.arm, rig=rig, bus=bus)


def build_operator(rig: Rig) -> Operator | None:
    """Return who arms this rig's station without hardware, None where a person must."""
    return None if rig.operator is None else _make(rig.operator, "operator")


def build_view(resolved: Resolved) -> "View | None":
    """Return what shows arm and table while somebody drives, not yet opened; None where the rig names nothing."""
    return None if resolved.rig.view is None else _make(resolved.rig.view, "view", resolved=resolved)


def build_shadow(resolved: Resolved) -> "Shadow":
    """Return what a driver's intents are tried on.

    Raises:
        RobotConfigError: the rig names nothing for it.
    """
    if resolved.rig.shadow is None:
        raise RobotConfigError(f"rig {resolved.rig.name}: expected a shadow to try intents on, it names none")
    return _make(resolved.rig.shadow, "shadow", resolved=resolved)


def _make(import_string: str, what: str, **parts: object) -> Any:  # noqa: ANN401
    """Return what an import string's class makes of its parts.

    Raises:
        RobotConfigError: it names no class, or one that is made of something else.
    """
    kind = load(import_string)
    if not isinstance(kind, type):
        raise RobotConfigError(f"{what}: expected an import string of a class, {import_string!r} names {kind!r}")
    try:
        inspect.signature(kind).bind(**parts)
    except TypeError as error:
        raise RobotConfigError(
            f"{what}: expected a class that takes {sorted(parts)}, {import_string!r}: {error}"
        ) from error
    return kind(**parts)
