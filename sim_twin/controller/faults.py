"""What can be made to go wrong with a virtual controller, and the truth to judge it by."""

import time
from collections.abc import Callable

import msgspec
import numpy as np

from sim_twin.controller.motion import DhRow, Measured, calibrated
from sim_twin.controller.robot import VirtualRobot
from sim_twin.controller.states import Event
from sim_twin.controller.ticks import TickTimes
from sim_twin.controller.wire import Wires

__all__ = ["FaultError", "Faults"]

SLICES_PER_MS = 0.5
Answer = dict[str, object]


class FaultError(ValueError):
    """There is no such fault, or its numbers make no sense."""


class Faults:
    """Faults by name. Whoever tests a client asks for them; a robot has none of these doors.

    Args:
        robot: The robot.
        wires: Its ports.
        ticks: What its slices cost.
        seed: Of the noise.

    Attributes:
        is_frozen: Ports and physics stand still.
    """

    def __init__(self, robot: VirtualRobot, wires: Wires, ticks: TickTimes, *, seed: int = 0) -> None:
        self._robot, self._wires, self._ticks = robot, wires, ticks
        self._rng = np.random.default_rng([seed, 1])
        self.is_frozen = False
        self._late_s, self._n_late_every, self._n_ticks = 0.0, 0, 0
        self._bias_rad, self._noise_rad = np.zeros(6), 0.0
        self._by_name: dict[str, Callable[..., Answer | None]] = {
            "bias": self.bias,
            "calibrate": self.calibrate,
            "delay": self.delay_links,
            "drop": self.drop_links,
            "estop": lambda: self._happen(Event.ROBOT_ESTOP),
            "estop_release": lambda: self._happen(Event.ROBOT_ESTOP_RELEASED),
            "fault": lambda: self._happen(Event.FAULT),
            "freeze": self.freeze_interfaces,
            "freeze_all": self.freeze_all,
            "inputs": self.force_inputs,
            "jog": self.jog,
            "late": self.late_ticks,
            "log": self.log,
            "noise": self.noise,
            "payload": self.payload,
            "program": lambda: {"text": self._robot.programs.last_text},
            "program_stop": lambda: self._happen(Event.STOP),
            "protective_stop": lambda: self._happen(Event.PROTECTIVE_STOP),
            "push": self.push,
            "reduced": lambda on=True: self._happen(Event.REDUCED if on else Event.REDUCED_ENDED),
            "refuse": self.refuse_links,
            "remote": self.remote_control,
            "reserve": self.reserve,
            "safeguard_close": lambda: self._happen(Event.SAFEGUARD_CLOSED),
            "safeguard_open": lambda: self._happen(Event.SAFEGUARD_OPENED),
            "ticks": self.tick_times,
            "truth": self.truth,
            "violation": lambda: self._happen(Event.VIOLATION),
        }

    @property
    def names(self) -> tuple[str, ...]:
        """What can be asked for."""
        return tuple(sorted(self._by_name))

    def apply(self, name: str, **numbers: object) -> Answer:
        """Bring a fault about, or end it, and return what it tells, and when it was (at_s, the host's monotonic time).

        Raises:
            FaultError: there is none of that name, or it takes other arguments.
        """
        fault = self._by_name.get(name)
        if fault is None:
            raise FaultError(f"expected one of {', '.join(self.names)}; got {name!r}")
        try:
            return {**(fault(**numbers) or {}), "at_s": time.monotonic()}
        except (TypeError, ValueError) as error:
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

    def delay_links(self, ms: float = 0.0, port: int | None = None) -> None:
        """Let everything said in either direction be late; 0 ends it."""
        for each in self._ports(port):
            each.delay_ticks = max(0, round(ms * SLICES_PER_MS))

    def freeze_interfaces(self, on: bool = True, port: int | None = None) -> None:
        """Let the ports stand still while physics and programs go on."""
        for each in self._ports(port):
            each.is_frozen = on

    def freeze_all(self, on: bool = True) -> None:
        """Let everything stand still."""
        self.is_frozen = on

    def reserve(self, names: list[str] | None = None) -> None:
        """Let a field bus own these RTDE inputs; no names frees them."""
        self._wires.rtde.reserve(names or [])

    def remote_control(self, on: bool = True) -> None:
        """Turn the pendant's switch to remote or to local control."""
        self._robot.machine.modes.is_remote = on

    # ---------------------------------------------------------------------------------------------- time and sensors

    def late_ticks(self, ms: float = 0.0, every: int = 1) -> None:
        """Let every so many slices take so much longer; 0 ms ends it."""
        if not 0.0 <= ms <= 10_000.0 or every < 1:
            raise ValueError(f"expected 0 to 10000 ms and every 1 or more, got {ms} ms every {every}")
        self._late_s, self._n_late_every, self._n_ticks = ms * 1e-3, every, 0

    def delay(self) -> None:
        """Take the time of a late slice; the loop calls it after each."""
        if self._late_s > 0.0:
            self._n_ticks += 1
            if self._n_ticks % self._n_late_every == 0:
                time.sleep(self._late_s)

    def bias(self, rad: list[float] | None = None) -> None:
        """Let the joints be read so much off; nothing ends it."""
        bias = np.zeros(6) if rad is None else np.array(rad, dtype=np.float64)
        if bias.shape != (6,):
            raise ValueError(f"expected 6 angles, got {bias.size}")
        self._bias_rad = bias
        self._set_disturbance()

    def noise(self, rad: float = 0.0) -> None:
        """Let the joints be read with normal noise of a standard deviation; 0 ends it."""
        self._noise_rad = float(rad)
        self._set_disturbance()

    def payload(self, kg: float = 0.0) -> None:
        """Let so much more hang on the flange than the controller was told; 0 ends it."""
        self._robot.machine.drive.hang(float(kg))

    def calibrate(self, mm: float = 0.0, mrad: float = 0.0) -> Answer:
        """Let the controller's Denavit-Hartenberg rows differ from nominal by as much, each by chance; 0 ends it.

        Told back as rows of (a m, d m, alpha rad, theta rad).
        """
        kinematics = self._robot.machine.drive.kinematics
        most = 1e-3 * np.array([mm, mm, mrad, mrad])
        off = self._rng.uniform(-1.0, 1.0, (len(kinematics.nominal), 4)) * most
        deltas = tuple(DhRow(a_m=a, d_m=d, alpha_rad=alpha, theta_rad=theta) for a, d, alpha, theta in off.tolist())
        kinematics.recalibrate(calibrated(kinematics.nominal, deltas))
        return {"rows": off.tolist()}

    def jog(self, rad: list[float]) -> None:
        """Let somebody at the pendant move the joints by as much, with a program of his own."""
        if len(rad) != 6:
            raise ValueError(f"expected 6 angles, got {len(rad)}")
        q = [float(a) + float(b) for a, b in zip(self._robot.machine.drive.measured.q_rad, rad, strict=True)]
        self._robot.submit_script(f"def jog():\n movej({q}, a=1.0, v=0.5)\nend\n")

    def force_inputs(self, bits: int = 0) -> None:
        """Let these digital inputs be on, whatever the table says."""
        self._robot.forced_inputs = bits

    def push(self, nm: list[float] | None = None) -> None:
        """Push on the joints from outside, as a person would; nothing ends it."""
        torques = [0.0] * 6 if nm is None else [float(t) for t in nm]
        if len(torques) != 6:
            raise ValueError(f"expected 6 torques, got {len(torques)}")
        self._robot.machine.world.data.qfrc_applied[:6] = torques

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
        }

    def tick_times(self, clear: bool = False) -> Answer:
        """Return what slices cost (µs) and how many slots were missed."""
        answer: Answer = {**self._ticks.percentiles_us(), "n_missed": self._ticks.n_missed}
        if clear:
            self._ticks.clear()
        return answer

    def log(self, last: int = 100) -> Answer:
        """Return the log's last lines."""
        lines = list(self._robot.machine.journal.lines)[-max(1, last) :]
        return {"lines": [text for _, text in lines]}

    # -------------------------------------------------------------------------------------------------------- inside

    def _happen(self, event: Event) -> Answer:
        refusal = self._robot.programs.handle(event).refusal
        return {} if refusal is None else {"refusal": refusal}

    def _ports(self, number: int | None) -> list:
        ports = self._wires.port_by_number
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
        q = measured.q_rad + self._bias_rad + self._rng.normal(0.0, 1.0, 6) * self._noise_rad
        return msgspec.structs.replace(measured, q_rad=q, tcp_pose=drive.kinematics.pose(q, drive.core.tcp_offset))
