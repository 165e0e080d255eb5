"""What can be made to go wrong with a virtual controller, and the truth to judge it by."""

import time
from collections.abc import Callable, Mapping
from inspect import Parameter, signature
from typing import Annotated, TypeAlias, get_type_hints

import msgspec
import numpy as np

from sim_twin.controller.io import N_DIGITAL
from sim_twin.controller.motion import SLICE_S, DhRow, Measured, calibrated
from sim_twin.controller.motion.poses import pose_from_matrix
from sim_twin.controller.robot import VirtualRobot
from sim_twin.controller.states import Event, Reaction
from sim_twin.controller.ticks import TickTimes
from sim_twin.controller.wire import Wires, input_fields

__all__ = ["FaultError", "Faults"]

SLICES_PER_MS = 0.5
SPEED_FILTER_S = 0.25
"""Time constant of the noise of speeds, a guess: UR's own filter is not published. 1 mrad makes 4 mrad/s of it."""
LOOK_S = 0.1
"""A slice that takes longer is broken by looks at the faults' door."""
Answer = dict[str, object]
Milliseconds: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=10_000.0)]
Often: TypeAlias = Annotated[int, msgspec.Meta(ge=1, le=1_000_000)]
Angle: TypeAlias = Annotated[float, msgspec.Meta(ge=-6.3, le=6.3)]
Angles: TypeAlias = tuple[Angle, Angle, Angle, Angle, Angle, Angle]
Torque: TypeAlias = Annotated[float, msgspec.Meta(ge=-300.0, le=300.0)]
"""Twice what the strongest joint of such an arm gives."""
Torques: TypeAlias = tuple[Torque, Torque, Torque, Torque, Torque, Torque]
Deviation: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=0.5)]
OffNominal: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=100.0)]
Friction: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=300.0)]
Frictions: TypeAlias = tuple[Friction, Friction, Friction, Friction, Friction, Friction]
Gain: TypeAlias = Annotated[float, msgspec.Meta(ge=0.1, le=10.0)]
Share: TypeAlias = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Whole: TypeAlias = Annotated[int, msgspec.Meta(ge=0, le=(1 << 63) - 1)]
Bits: TypeAlias = Annotated[int, msgspec.Meta(ge=0, lt=1 << N_DIGITAL)]
Lines: TypeAlias = Annotated[int, msgspec.Meta(ge=1, le=1000)]


class FaultError(ValueError):
    """There is no such fault, or its numbers make no sense."""


class Faults:
    """Faults by name. Whoever tests a client asks for them; a robot has none of these doors.

    Args:
        robot: The robot.
        wires: Its ports; None where it has none.
        ticks: What its slices cost.
        seed: Of the noise.

    Attributes:
        is_frozen: Ports and physics stand still.
    """

    def __init__(self, robot: VirtualRobot, wires: Wires | None, ticks: TickTimes, *, seed: int = 0) -> None:
        self._robot, self._wires, self._ticks = robot, wires, ticks
        self._rng = np.random.default_rng([seed, 1])
        self.is_frozen = False
        self._late_s, self._n_late_every, self._n_ticks = 0.0, 0, 0
        self._bias_rad, self._noise_rad = np.zeros(6), 0.0
        self._noise_before = self._noise_rad_s = np.zeros(6)
        self._by_name: dict[str, Callable[..., Answer | None]] = {
            "bias": self.bias,
            "calibrate": self.calibrate,
            "delay": self.delay_links,
            "drag": self.drag,
            "drop": self.drop_links,
            "estop": lambda: self._happen(Event.ROBOT_ESTOP),
            "estop_release": lambda: self._happen(Event.ROBOT_ESTOP_RELEASED),
            "fault": lambda: self._happen(Event.FAULT),
            "freeze": self.freeze_interfaces,
            "freeze_all": self.freeze_all,
            "inputs": self.force_inputs,
            "jog": self.jog,
            "late": self.late_ticks,
            "lay_out": self.lay_out,
            "log": self.log,
            "noise": self.noise,
            "payload": self.payload,
            "program": lambda: {"text": self._robot.programs.last_text},
            "program_stop": lambda: _told(self._robot.programs.stop()),
            "protective_stop": lambda: self._happen(Event.PROTECTIVE_STOP),
            "push": self.push,
            "reduced": self.reduced,
            "refuse": self.refuse_links,
            "remote": self.remote_control,
            "reserve": self.reserve,
            "servo": self.servo,
            "safeguard_close": lambda: self._happen(Event.SAFEGUARD_CLOSED),
            "safeguard_open": lambda: self._happen(Event.SAFEGUARD_OPENED),
            "safeguard_reset": lambda: self._happen(Event.SAFEGUARD_RESET),
            "slider": self.slider,
            "system_estop": lambda: self._happen(Event.SYSTEM_ESTOP),
            "system_estop_release": lambda: self._happen(Event.SYSTEM_ESTOP_RELEASED),
            "terminal": self.safety_terminal,
            "ticks": self.tick_times,
            "truth": self.truth,
            "violation": lambda: self._happen(Event.VIOLATION),
        }

    @property
    def names(self) -> tuple[str, ...]:
        """What can be asked for."""
        return tuple(sorted(self._by_name))

    def apply(self, name: str, /, **numbers: object) -> Answer:
        """Bring a fault about, or end it, and return what it tells, and when it was (at_s, the host's monotonic time).

        Raises:
            FaultError: there is none of that name, or it takes other arguments.
        """
        fault = self._by_name.get(name)
        if fault is None:
            raise FaultError(f"expected one of {', '.join(self.names)}; got {name!r}")
        arguments = _typed(name, fault, numbers)
        try:
            return {**(fault(**arguments) or {}), "at_s": time.monotonic()}
        except ValueError as error:
            raise FaultError(f"{name}: {error}") from error

    # -------------------------------------------------------------------------------------------------------- links

    def drop_links(self, port: int | None = None) -> None:
        """Cut every connection, of one port or of all; clients may connect again."""
        for each in self._ports(port):
            each.drop_peers()

    def refuse_links(self, on: bool = True, port: int | None = None) -> None:
        """Take no new connections."""
        for each in self._ports(port):
            each.refuse() if on else each.listen()

    def delay_links(self, ms: Milliseconds = 0.0, port: int | None = None) -> None:
        """Let everything said in either direction be late; 0 ends it."""
        for each in self._ports(port):
            each.delay_ticks = round(ms * SLICES_PER_MS)

    def freeze_interfaces(self, on: bool = True, port: int | None = None) -> None:
        """Let the ports stand still while physics and programs go on."""
        for each in self._ports(port):
            each.is_frozen = on

    def freeze_all(self, on: bool = True) -> None:
        """Let everything stand still."""
        self.is_frozen = on

    def reserve(self, names: list[str] | None = None) -> None:
        """Let a field bus own these RTDE inputs; no names frees them."""
        strange = sorted(set(names or []) - input_fields(self._robot.machine.version).keys())
        if strange:
            raise ValueError(f"expected names of RTDE inputs, got {strange[0][:40]!r}")
        if self._wires is None:
            raise ValueError("expected a controller with ports, this one has none")
        self._wires.rtde.reserve(names or [])

    def remote_control(self, on: bool = True) -> None:
        """Turn the pendant's switch to remote or to local control."""
        self._robot.programs.turn_remote(on)

    # ---------------------------------------------------------------------------------------------- time and sensors

    def late_ticks(self, ms: Milliseconds = 0.0, every: Often = 1) -> None:
        """Let every so many slices take so much longer; 0 ms ends it."""
        self._late_s, self._n_late_every, self._n_ticks = ms * 1e-3, every, 0

    def delay(self, meanwhile: Callable[[], None]) -> None:
        """Take the time of a late slice; the loop calls it after each.

        Args:
            meanwhile: Called now and then where it is long, so that somebody can end it.
        """
        if self._late_s <= 0.0:
            return
        self._n_ticks += 1
        if self._n_ticks % self._n_late_every:
            return
        late_s = self._late_s
        due_s = time.monotonic() + late_s
        while self._late_s == late_s and (left_s := due_s - time.monotonic()) > 0.0:
            time.sleep(min(left_s, LOOK_S))
            if late_s > LOOK_S:
                meanwhile()

    def bias(self, rad: Angles | None = None) -> None:
        """Let the joints be read so much off; nothing ends it."""
        self._bias_rad = np.zeros(6) if rad is None else np.array(rad)
        self._set_disturbance()

    def noise(self, rad: Deviation = 0.0) -> None:
        """Let the joints be read with normal noise of a standard deviation, their speeds with what follows from it.

        0 ends it.
        """
        self._noise_rad = rad
        self._noise_before = self._noise_rad_s = np.zeros(6)
        self._set_disturbance()

    def payload(self, kg: float = 0.0) -> None:
        """Let so much more hang on the flange than the controller was told; 0 ends it."""
        self._robot.machine.drive.hang(kg)

    def drag(self, nm: Frictions | None = None, nm_s: Frictions | None = None) -> None:
        """Let joints drag: by so much whenever they move, and by so much more at 1 rad/s; nothing ends it."""
        drive = self._robot.machine.drive
        drive.hidden.drag(nm or (0.0,) * 6, nm_s or (0.0,) * 6)
        drive.refresh()

    def servo(self, stiffness: Gain = 1.0, damping: Gain = 1.0) -> None:
        """Let the servos be so many times as stiff and as damped as they were built; 1 ends it."""
        drive = self._robot.machine.drive
        drive.hidden.retune(stiffness, damping)
        drive.refresh()

    def calibrate(self, mm: OffNominal = 0.0, mrad: OffNominal = 0.0) -> Answer:
        """Let the controller's Denavit-Hartenberg rows differ from nominal by as much, each by chance; 0 ends it.

        Told back as rows of (a m, d m, alpha rad, theta rad).
        """
        kinematics = self._robot.machine.drive.kinematics
        most = 1e-3 * np.array([mm, mm, mrad, mrad])
        off = self._rng.uniform(-1.0, 1.0, (len(kinematics.nominal), 4)) * most
        deltas = tuple(DhRow(a_m=a, d_m=d, alpha_rad=alpha, theta_rad=theta) for a, d, alpha, theta in off.tolist())
        kinematics.recalibrate(calibrated(kinematics.nominal, deltas))
        return {"rows": off.tolist()}

    def jog(self, rad: Angles) -> Answer:
        """Let somebody at the pendant move the joints by as much, with a program of his own.

        It works in the recovery mode too, where no program does, and is the way back from beyond a plane or a limit.
        """
        refusal = self._robot.jog(np.array(rad))
        return {} if refusal is None else {"refusal": f"jog: {refusal}"}

    def lay_out(self, seed: Whole, epoch: Whole) -> None:
        """Let somebody's hands lay the table out as an epoch's reset would; the arm stays, with no program."""
        self._robot.lay_out(seed=seed, epoch=epoch, digital_out=self._robot.machine.io.digital_out, keeps_arm=True)

    def force_inputs(self, bits: Bits = 0) -> None:
        """Let these digital inputs be on, whatever the table says."""
        self._robot.forced_inputs = bits

    def slider(self, share: Share = 1.0) -> None:
        """Let somebody at the pendant move the speed slider."""
        self._robot.machine.drive.core.pace.set_slider(share)

    def push(self, nm: Torques | None = None) -> None:
        """Push on the joints from outside, as a person would; nothing ends it."""
        self._robot.machine.world.data.qfrc_applied[:6] = nm or (0.0,) * 6

    def safety_terminal(self, name: str, on: bool = False) -> Answer:
        """Open a safety input of the installation, or close it (on); see SafetyTerminals."""
        programs, safety = self._robot.programs, self._robot.safety
        refusal = safety.set(name, is_closed=on, handle=lambda event: programs.handle(event).refusal)
        return {} if refusal is None else {"refusal": refusal}

    def reduced(self, on: bool = True) -> Answer:
        """Let the reduced mode begin or end."""
        return self._happen(Event.REDUCED if on else Event.REDUCED_ENDED)

    # ------------------------------------------------------------------------------------------------------- judging

    def truth(self) -> Answer:
        """Return the twin's own joints, whatever the interfaces say."""
        machine = self._robot.machine
        data = machine.world.data
        return {
            "n_slices": machine.drive.n_slices,
            "time_s": machine.time_s,
            "q_rad": data.qpos[:6].tolist(),
            "qd_rad_s": data.qvel[:6].tolist(),
            "opening_m": self._robot.hand.opening_m,
            "digital_out": machine.io.digital_out,
            "runtime": machine.modes.runtime.name,
            "robot_mode": machine.modes.robot.name,
            "safety_mode": machine.modes.safety.name,
            "safety_inputs": self._robot.safety.closed,
        }

    def tick_times(self, clear: bool = False) -> Answer:
        """Return what slices cost (µs) and how many slots were missed."""
        answer: Answer = {**self._ticks.percentiles_us(), "n_missed": self._ticks.n_missed}
        if clear:
            self._ticks.clear()
        return answer

    def log(self, last: Lines = 100) -> Answer:
        """Return the log's last lines."""
        lines = list(self._robot.machine.journal.lines)[-last:]
        return {"lines": [text for _, text in lines]}

    # -------------------------------------------------------------------------------------------------------- inside

    def _happen(self, event: Event) -> Answer:
        return _told(self._robot.programs.handle(event))

    def _ports(self, number: int | None) -> list:
        ports = {} if self._wires is None else self._wires.port_by_number
        if number is None:
            return list(ports.values())
        if number not in ports:
            raise ValueError(f"expected one of the ports {sorted(ports)}, got {number}")
        return [ports[number]]

    def _set_disturbance(self) -> None:
        is_exact = self._noise_rad == 0.0 and not self._bias_rad.any()
        self._robot.disturb = None if is_exact else self._disturbed

    def _disturbed(self, measured: Measured) -> Measured:
        drive = self._robot.machine.drive
        noise = self._rng.normal(0.0, 1.0, 6) * self._noise_rad
        q = measured.q_rad + self._bias_rad + noise
        # Speeds are found from angles: their noise is that of differences, smoothed.
        share = SLICE_S / (SLICE_S + SPEED_FILTER_S)
        self._noise_rad_s = self._noise_rad_s + share * ((noise - self._noise_before) / SLICE_S - self._noise_rad_s)
        self._noise_before = noise
        qd = measured.qd_rad_s + self._noise_rad_s
        T_bt, J = drive.kinematics.forward_and_jacobian(q, drive.core.T_ft)
        return msgspec.structs.replace(
            measured, q_rad=q, qd_rad_s=qd, tcp_pose=pose_from_matrix(T_bt), tcp_speed=J @ qd
        )


def _told(reaction: Reaction) -> Answer:
    return {} if reaction.refusal is None else {"refusal": reaction.refusal}


def _typed(name: str, fault: Callable[..., Answer | None], numbers: Mapping[str, object]) -> dict[str, object]:
    """Return a fault's arguments as its signature types and bounds them.

    Raises:
        FaultError: they are not what it takes.
    """
    known = signature(fault).parameters
    strange = [key for key in numbers if key not in known]
    missing = [key for key, p in known.items() if p.default is Parameter.empty and key not in numbers]
    if strange or missing:
        takes = ", ".join(known) or "none"
        raise FaultError(f"{name}: expected the arguments {takes}; got {', '.join(numbers)[:80] or 'none'}")
    hints = get_type_hints(fault, include_extras=True)
    typed: dict[str, object] = {}
    for key, value in numbers.items():
        try:
            typed[key] = msgspec.convert(value, hints[key])
        except msgspec.ValidationError as error:
            raise FaultError(f"{name}: {key}: {error}") from error
    return typed
