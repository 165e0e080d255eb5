"""The controller as a process: ports, robot, wall time, faults. One loop, one slice at a time."""

import gc
import sys
from collections.abc import Callable
from ipaddress import IPv4Address, IPv6Address, ip_address
from time import perf_counter
from types import TracebackType
from typing import Self

import msgspec

from config.loader import load_cell
from config.wiring import check_cell_fits
from robot.errors import RobotError
from sim_twin.controller.bus_port import BusPort
from sim_twin.controller.compiling import ThreadCompiler
from sim_twin.controller.control_port import CONTROL, ControlPort
from sim_twin.controller.faults import Faults
from sim_twin.controller.motion import SLICE_S
from sim_twin.controller.pacing import Pacer
from sim_twin.controller.planes import PlaneNumbers, planes_of
from sim_twin.controller.robot import VirtualRobot, make_world
from sim_twin.controller.safety_terminals import SafetyTerminals
from sim_twin.controller.ticks import TickTimes
from sim_twin.controller.trace import TraceWriter
from sim_twin.controller.wire import ControllerVersion, Wires
from sim_twin.controller.wire.reactor import Reactor
from sim_twin.controller.wire.rtde_codec import Level

__all__ = ["PRIORITY", "ControllerServer", "Setup", "parse_version"]

MOST_TOLD = 20
"""Remarks of programs that whoever started a controller is told."""
CONTROL_TICKS = 5
"""The faults' door is looked at this often: a look costs as much as a tenth of the physics."""
PLAYED, MOST_MINOR = (3, 5), 99
PRIORITY = 45
"""What a process that runs nothing else may ask of the kernel: it stands for a box of its own, before its clients."""
SWEEP_TICKS = 30_000
"""Rubbish is looked for this often, and only while there is no program: a search among the parts of one takes up to
half a second, in which nothing else runs. Programs leave next to none."""
SEARCH_NEVER = 1_000_000_000
SWITCH_S = 0.0002
"""How long the compiler's thread may keep the interpreter from the loop."""


class Setup(msgspec.Struct, frozen=True, kw_only=True):
    """What a controller is started with."""

    host: str = "127.0.0.2"
    version: str = "5.11.0"
    scenario: str = "paper"
    seed: int = 0
    is_powered: bool = True
    is_any_host_allowed: bool = False
    script: str = ""
    """Text of a program to run at the start."""
    shelf: dict[str, str] = {}
    """Texts of programs that the dashboard can load, by the name that it loads them by."""
    cell: str = ""
    """A shipped cell's name or a path: how the table is wired to the control box; straight through where empty."""
    safety_inputs: dict[str, str] = {}
    """Terminals by safety function, such as system_estop: CI0; see safety_terminals.py."""
    planes: tuple[PlaneNumbers, ...] = ()
    """Safety planes of the installation: normal (base frame) and offset along it (m); the tool stays on its side."""
    bus: str = ""
    """Zenoh endpoint to listen on: the twin's truth, and resets of its table."""
    keys: str = ""
    """Folder of certificates and their ledger, for an endpoint that others can reach."""
    trace: str = ""
    """File for the twin's own joints, slice by slice; see trace.py."""


def parse_version(text: str) -> ControllerVersion:
    """Return the version of three or four numbers with dots.

    Raises:
        ValueError: it is none, or of a box that this controller does not play.
    """
    parts = text.split(".")
    if not 2 <= len(parts) <= 4 or not all(part.isascii() and part.isdecimal() and len(part) <= 9 for part in parts):
        raise ValueError(f"version: expected numbers such as 5.11.0, got {text[:40]!r}")
    fields = dict(zip(("major", "minor", "bugfix", "build"), map(int, parts), strict=False))
    version = ControllerVersion(**fields)
    if version.major not in PLAYED or version.minor > MOST_MINOR:
        raise ValueError(
            f"version: expected 3.x (CB3) or 5.x (e-Series) up to .{MOST_MINOR}, got {text}; "
            "PolyScope X is another controller, and there are no others"
        )
    return version


def _address_of(host: str) -> IPv4Address | IPv6Address:
    try:
        return ip_address(host)
    except ValueError:
        raise ValueError(f"host: expected an IP address, such as 127.0.0.2, got {host!r}") from None


def _check_script(robot: VirtualRobot, text: str) -> None:
    """Refuse a script that is no program for this controller, with the line at fault.

    Raises:
        ValueError: it is none.
    """
    mistake = robot.mistake_in(text)
    if mistake is not None:
        lines = text.splitlines()
        at = f"; that line is {lines[mistake.line - 1].strip()!r}" if 0 < mistake.line <= len(lines) else ""
        raise ValueError(f"script: {mistake.message}{at}")


class ControllerServer:
    """One virtual controller on its ports.

    Args:
        setup: What it is started with.
        told: Told of the first errors of programs, in words.

    Attributes:
        robot: The robot behind the ports.
        wires: The ports.
        faults: What can be made to go wrong.
        ticks: What slices cost.

    Raises:
        ValueError: the host is no loopback address and that is not allowed, or the version, a plane, a safety input or
            the script is none.
    """

    def __init__(self, setup: Setup, *, told: Callable[[str], object] | None = None) -> None:
        self._told, self._n_told = told, 0
        if not setup.is_any_host_allowed and not _address_of(setup.host).is_loopback:
            raise ValueError(
                f"host: expected a loopback address, got {setup.host}; a virtual robot obeys anybody who connects, "
                "so others must be allowed with --allow-any"
            )
        self.setup = setup
        version = parse_version(setup.version)
        planes = planes_of(setup.planes)
        world = make_world(scenario=setup.scenario, seed=setup.seed)
        cell = load_cell(setup.cell) if setup.cell else None
        if cell is not None:
            check_cell_fits(world.scenario, cell, setup.cell)
        self.robot = robot = VirtualRobot(
            world, version=version, is_powered=setup.is_powered, cell=cell, compiler=ThreadCompiler,
            safety=SafetyTerminals(setup.safety_inputs),
        )  # fmt: skip
        if setup.script:
            _check_script(robot, setup.script)
        drive = robot.machine.drive
        drive.limits = msgspec.structs.replace(drive.limits, planes=planes)
        robot.programs.shelf.update(setup.shelf)
        self.wires = Wires(
            outputs=robot.outputs,
            inputs=robot.machine,
            dashboard=robot.panel,
            states=robot.panel,
            scripts=robot,
            gripper=robot.hand,
            version=version,
            stamp_us=lambda: robot.machine.stamp_us,
            hear=robot.machine.journal.note,
        )
        self.ticks = TickTimes()
        self.faults = Faults(robot, self.wires, self.ticks, seed=setup.seed)
        self._control = Reactor()
        self._n_ticks = 0
        self._bus: BusPort | None = None
        self._trace: TraceWriter | None = None

    def __enter__(self) -> Self:
        """Open the ports.

        Raises:
            OSError: a port is taken.
            RobotError: the bus's endpoint is taken, is none, or is not one that this may listen at.
        """
        try:
            self.wires.open(self.setup.host)
            if ip_address(self.setup.host).is_loopback:
                self._control.listen(self.setup.host, CONTROL, ControlPort(self.faults))
            if self.setup.trace:
                self._trace = TraceWriter(self.setup.trace)
            if self.setup.bus:
                self._bus = BusPort(self.robot, self.setup.bus, keys=self.setup.keys or None)
        except (OSError, RobotError):
            self.close()
            raise
        if self.setup.script:
            self.robot.submit_script(self.setup.script)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Shut the ports and end the programs; a second call does nothing."""
        if self._bus is not None:
            self._bus.close()
            self._bus = None
        if self._trace is not None:
            self._trace.close()
            self._trace = None
        self._control.close()
        self.wires.close()
        self.robot.close()

    def _say(self, remark: str) -> None:
        """Tell RTDE's clients, and whoever started this the first ones: a terminal that nobody reads would hold us."""
        self.wires.rtde.say(remark, level=Level.ERROR, source="Controller")
        self._n_told += 1
        if self._told is not None and self._n_told <= MOST_TOLD:
            self._told(remark)

    def tick(self) -> None:
        """Poll, let one slice pass, and send what is due."""
        begun = perf_counter()
        self._n_ticks += 1
        if self._n_ticks % CONTROL_TICKS == 0:
            self._control.poll()
        if not self.faults.is_frozen:
            self.wires.poll()
            self.robot.step()
            outbox = self.robot.machine.journal.outbox
            while outbox:
                self.wires.states.tell(outbox.popleft())
            remarks = self.robot.machine.journal.remarks
            while remarks:
                self._say(remarks.popleft())
            self.wires.tick(self.robot.machine.drive.n_slices)
            if self._bus is not None:
                self._bus.tick(self.robot.machine.drive.n_slices)
            if self._trace is not None:
                self._note(self._trace)
        spent_s = perf_counter() - begun
        self.robot.machine.execution_s = spent_s
        self.ticks.add(spent_s)

    def run(self, *, when_ready: Callable[[], None], is_over: Callable[[], bool] = lambda: False) -> None:
        """Run in wall time until somebody ends it.

        Args:
            when_ready: Called when the ports are open.
            is_over: Asked before every slice.
        """
        sys.setswitchinterval(SWITCH_S)
        gc.collect()
        gc.freeze()
        gc.set_threshold(*gc.get_threshold()[:2], SEARCH_NEVER)
        when_ready()
        pacer = Pacer(period_ns=round(SLICE_S * 1e9))
        while not (is_over() or self.robot.panel.is_shut_down or self.robot.machine.is_shut_down):
            self.tick()
            self.faults.delay(self._control.poll)
            pacer.wait()
            self.ticks.n_missed = pacer.n_missed
            self._sweep()

    def _sweep(self) -> None:
        if self._n_ticks % SWEEP_TICKS == 0 and self.robot.is_idle and self.robot.programs.is_empty:
            gc.collect()

    def _note(self, trace: TraceWriter) -> None:
        drive = self.robot.machine.drive
        data = drive.world.data
        trace.add(drive.n_slices, drive.is_braked, data.qpos[:6], data.qvel[:6])
