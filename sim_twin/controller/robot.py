"""The virtual robot: everything behind the ports, one 2 ms slice at a time. It knows no clock."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np

from config.cell import CellConfig
from config.loader import resolve
from robot.kinematics import Kinematics
from robot.layout import draw_layout
from sim_twin.controller.box import Box
from sim_twin.controller.builtins import program_builtins
from sim_twin.controller.compiling import Compiler, InlineCompiler, MakeBuiltins, Mistake, compile_text
from sim_twin.controller.hand import Hand
from sim_twin.controller.machine import Machine
from sim_twin.controller.motion import SLICE_S, Breach, Measured
from sim_twin.controller.motion.poses import Array
from sim_twin.controller.outputs import make_outputs
from sim_twin.controller.panel import Panel
from sim_twin.controller.program import Programs
from sim_twin.controller.safety_terminals import SafetyTerminals
from sim_twin.controller.script import Builtins
from sim_twin.controller.script.builtins import Sockets
from sim_twin.controller.states import Event, RobotMode, RuntimeState
from sim_twin.controller.watchdogs import WatchdogAction
from sim_twin.controller.wire import ControllerVersion, ScriptSource
from sim_twin.plant import TwinWorld

__all__ = ["VirtualRobot", "make_world"]

JOG_RAD_S, RECOVERY_RAD_S = 0.5, 0.25
"""The latter keeps the tool below the 250 mm/s of UR's recovery mode."""
_PROTECTIVE_BIT, _VIOLATION_BIT = 1 << 2, 1 << 8
_STARVED = {WatchdogAction.PAUSE: Event.PAUSE, WatchdogAction.STOP: Event.STOP}


def make_world(*, scenario: str | Path = "paper", rig: str | Path = "twin", seed: int = 0) -> TwinWorld:
    """Return a twin whose tick is one slice, its table drawn and its arm at home.

    Raises:
        ConfigError: a file is missing or wrong.
    """
    resolved = resolve(rig=rig, scenario=scenario)
    times = msgspec.structs.replace(resolved.rig, tick_s=SLICE_S, physics_s=SLICE_S)
    world = TwinWorld(resolved.arm, resolved.scenario, times)
    world.put(draw_layout(resolved.scenario, np.random.default_rng([seed, 0])), resolved.arm.home_rad, digital_out=0)
    return world


class VirtualRobot:
    """One controller and its arm.

    Args:
        world: The twin; `make_world` makes one.
        version: What the controller announces.
        is_powered: Begin with power on and brakes open.
        cell: How the table is wired to the control box; straight through where None.
        compiler: Makes programs of texts from builtins; inline, and so deterministic, where absent.
        safety: Safety inputs of the installation; none where absent.

    Attributes:
        machine: Drive, modes, registers, terminals.
        programs: What runs.
        hand: The gripper; wire.GripperTarget.
        outputs: RTDE's outputs by name.
        panel: wire.DashboardTarget and wire.StateSource.
        disturb: Fault: what becomes of a measurement before anybody sees it.
        box: The wires between table and terminals.
        safety: As given.
        forced_inputs: Fault: input bits that are on whatever the table says.
    """

    def __init__(
        self,
        world: TwinWorld,
        *,
        version: ControllerVersion | None = None,
        is_powered: bool = True,
        cell: CellConfig | None = None,
        compiler: Callable[[MakeBuiltins], Compiler] = InlineCompiler,
        safety: SafetyTerminals | None = None,
    ) -> None:
        self.machine = Machine(world, version=version or ControllerVersion())
        self.programs = Programs(self.machine, compiler(self._make_builtins))
        self.safety = safety or SafetyTerminals()
        modes = self.machine.modes
        modes.needs_safeguard_reset = self.safety.needs_safeguard_reset
        self.hand = Hand(world, is_powered=lambda: modes.robot not in (RobotMode.POWER_OFF, RobotMode.NO_CONTROLLER))
        self.outputs = make_outputs(self.machine, self.programs)
        self.panel = Panel(self.machine, self.programs)
        self.disturb: Callable[[Measured], Measured] | None = None
        self.forced_inputs = 0
        self.box = Box(cell)
        self._kinematics = Kinematics(world.arm)
        if is_powered:
            modes.robot = RobotMode.RUNNING
            self.machine.drive.engage()

    def submit_script(self, text: str, source: ScriptSource | None = None) -> None:
        """Take one complete program; wire.ScriptSink. In local control programs are refused."""
        if self.machine.modes.is_remote or source is None:
            self.programs.submit(text, is_remote=source is not None)
        else:
            self.machine.journal.note("a program was sent in local control and is ignored")

    def refuse_script(self, why: str, source: ScriptSource | None = None) -> None:  # noqa: ARG002 - all are told alike
        """Say why an upload was not read to its end; wire.ScriptSink."""
        self.programs.refuse(why)

    def step(self) -> None:
        """Let one slice pass; clients' inputs have been taken before."""
        machine, drive = self.machine, self.machine.drive
        machine.io.apply()
        self._watch()
        self.programs.step()
        if not machine.modes.may_move:
            drive.stiffen()
        machine.world.digital_out = self.box.drive(machine.io.digital_out)
        breach = drive.tick()
        if self.disturb is not None:
            drive.measured = self.disturb(drive.measured)
        if breach is not None:
            self._stop_for(breach)
        self.programs.obey(machine.modes.tick(is_standing=drive.is_standing))
        self._look_outside()
        machine.n_standing = machine.n_standing + 1 if drive.is_standing else 0
        table = self.box.sense(machine.world.table.read_inputs()) | self.forced_inputs
        machine.io.digital_in = self.safety.sense(table)
        machine.io.analog_in_v = self.box.measure(machine.world.table.travel)
        self.hand.tick()
        machine.journal.end_slice()

    @property
    def is_idle(self) -> bool:
        """Whether no program runs and the arm is at rest."""
        return self.machine.modes.runtime is RuntimeState.STOPPED and self.machine.drive.is_standing

    def lay_out(self, *, seed: int, epoch: int, digital_out: int, keeps_arm: bool = False) -> None:
        """Draw and place the table, the arm at its start, lids as the outputs say, the hand open (a reset).

        Args:
            seed: of the layout, with the epoch.
            epoch: of the layout.
            digital_out: outputs from now on.
            keeps_arm: the arm stays where it is, as when a person's hands lay out a table.

        Raises:
            ValueError: a program runs, or the arm is under way: it would go on from somewhere else.
        """
        machine, drive = self.machine, self.machine.drive
        if not self.is_idle:
            raise ValueError("expected no program and an arm at rest; stop the program first")
        world = machine.world
        layout = draw_layout(world.scenario, np.random.default_rng([seed, epoch]))
        start_rad = self._kinematics.solve(layout.start_m, world.arm.home_rad)
        world.put(layout, world.data.qpos[:6].tolist() if keeps_arm else start_rad, digital_out)
        machine.io.digital_out = self.box.put(digital_out)
        if not drive.is_braked:
            drive.engage()
        self.hand.open()

    def mistake_in(self, text: str) -> Mistake | None:
        """Return why a text is no program for this controller; None where it is one."""
        made = compile_text(text, self._make_builtins)
        if isinstance(made, Mistake):
            return made
        made.close()
        return None

    def _make_builtins(self, sockets: Sockets) -> Builtins:
        return program_builtins(self.machine, sockets)

    def close(self) -> None:
        """End programs and their connections."""
        self.programs.close()

    def _watch(self) -> None:
        machine = self.machine
        if machine.modes.runtime is not RuntimeState.PLAYING:
            return
        starved = machine.watchdogs.tick()
        if starved is not None:
            name, action = starved
            machine.journal.note(f"watchdog: {name} was not written in time, the program is to {action.value}")
            self.programs.handle(_STARVED[action])

    def _look_outside(self) -> None:
        """Begin the recovery mode where the arm has power beyond its limits, and end it once it is back."""
        modes = self.machine.modes
        if modes.robot is RobotMode.RUNNING and self.machine.drive.is_outside is not modes.is_recovering:
            self.programs.handle(Event.RECOVERED if modes.is_recovering else Event.RECOVERY)

    def jog(self, by_rad: Array) -> str | None:
        """Move the joints by as much as somebody at the pendant does, or tell why that cannot be.  (6,)"""
        refusal = self.programs.refusal
        if refusal is not None:
            return refusal
        speed = RECOVERY_RAD_S if self.machine.modes.is_recovering else JOG_RAD_S
        q = (self.machine.drive.measured.q_rad + by_rad).tolist()
        self.programs.submit(f"def jog():\n movej({q}, a=1.0, v={speed})\nend\n", is_by_hand=True)
        return None

    def _stop_for(self, breach: Breach) -> None:
        cause = breach.cause
        if self.machine.modes.safety_status_bits & (_VIOLATION_BIT if cause.is_violation else _PROTECTIVE_BIT):
            # What presses goes on pressing while the arm comes to rest: one blow is one stop.
            return
        argument = cause.value[1] if breach.joint is None else breach.joint
        self.machine.journal.error(cause.code, argument, breach.text, is_violation=cause.is_violation)
        event = Event.VIOLATION if cause.is_violation else Event.PROTECTIVE_STOP
        self.programs.handle(event, joint=breach.joint)
