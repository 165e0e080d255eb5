"""Looks at a UR arm with clients that cannot move it: they ask who it is, and listen to what its controller tells.

No control client is made, which would upload a program and stop whatever runs; no register and no output is written,
and the hand is not spoken to.
"""

from collections.abc import Sequence
from contextlib import suppress
from time import monotonic_ns, sleep

from rtde_receive import RTDEReceiveInterface

from config.arm import ArmConfig
from robot.errors import StaleStateError
from robot.hal.pins import Pins
from robot.hal.rtde_outputs import N_OUTPUTS
from robot.hal.rtde_probe import probe_rtde
from robot.hal.sight import Sight
from robot.hal.ur_calls import named
from robot.hal.ur_checks import tool_off_m
from robot.hal.ur_identity import identify
from robot.hal.ur_state import Runtime, kind_of_address, mode_of
from robot.messages import PlantIdentity, Vec3, Vec6

__all__ = ["UrObserver"]

RATE_HZ = 250.0
ALL_BITS = (1 << N_OUTPUTS) - 1
FIELDS = (
    "timestamp", "actual_q", "actual_qd", "actual_TCP_pose", "actual_TCP_speed", "actual_digital_output_bits",
    "robot_mode", "runtime_state", "safety_status_bits",
)  # fmt: skip
STALE_NS = 1_000_000_000
"""Nobody moves by what is seen here: a link counts as lost later than it does for whoever holds the arm."""
FIRST_S = 2.0


class UrObserver:
    """Implements robot.hal.sight.Observer.

    Args:
        arm: the arm's file.
        address: host or IP address of the controller.
        serial: the number that it must say it has.
        pins: the control box's wiring.
    """

    def __init__(self, *, arm: ArmConfig, address: str, serial: str, pins: Pins) -> None:
        self._arm, self._address, self._expected_serial, self._pins = arm, address, serial, pins
        self._receive: RTDEReceiveInterface | None = None
        self._timestamp_s, self._changed_ns = -1.0, 0
        self._serial, self._tool_off_m = "", 0.0

    @property
    def identity(self) -> PlantIdentity:
        """Which arm this is, from connect() on; before that its serial is empty."""
        return PlantIdentity(kind=kind_of_address(self._address), model=self._arm.name, serial=self._serial)

    @property
    def tool_off_m(self) -> float:
        """How far the arm's own kinematics bring the tool from where its file does, where it stands and at home."""
        return self._tool_off_m

    def connect(self) -> None:
        """Ask who it is, and listen from then on.

        Raises:
            WireError: somebody does not answer.
            RobotConfigError: another arm than the rig names, another model or software than this package is for.
            StaleStateError: the controller's own time stands still.
        """
        if self._receive is not None:
            return
        known = identify(address=self._address, arm=self._arm, serial=self._expected_serial)
        with suppress(RuntimeError):
            known.dashboard.disconnect()
        self._serial = known.serial
        self._tool_off_m = max(tool_off_m(known.facts, self._arm, q) for q in (known.facts.q_rad, self._arm.home_rad))
        probe_rtde(self._address)
        with named("RTDE", self._address):
            self._receive = RTDEReceiveInterface(self._address, RATE_HZ, list(FIELDS))
        self._changed_ns = monotonic_ns()
        self._await_first()

    def see(self) -> Sight:
        """Return the newest that was measured.

        Raises:
            StaleStateError: not connected, or the controller's own time has stood still for a second.
        """
        receive = self._receive
        if receive is None:
            raise StaleStateError("arm: expected connect() before looking at it; nothing was seen")
        now_ns, timestamp_s = monotonic_ns(), receive.getTimestamp()
        if timestamp_s > self._timestamp_s:
            self._timestamp_s, self._changed_ns = timestamp_s, now_ns
        elif now_ns - self._changed_ns > STALE_NS:
            raise StaleStateError(
                f"arm: expected its controller at {self._address} to tell of it all the time, it has been silent for "
                f"{(now_ns - self._changed_ns) / 1e9:.1f} s; is the link up?"
            )
        x, y, z, *_ = receive.getActualTCPPose()
        return Sight(
            seen_ns=now_ns,
            plant_s=timestamp_s,
            q_rad=_vec6(receive.getActualQ()),
            qd_rad_s=_vec6(receive.getActualQd()),
            tcp_m=(x, y, z),
            tcp_speed_m_s=_vec3(receive.getActualTCPSpeed()),
            digital_out=self._pins.signals_out(receive.getActualDigitalOutputBits() & ALL_BITS),
            mode=mode_of(receive.getRobotMode(), receive.getSafetyStatusBits()),
            is_program_running=int(receive.getRuntimeState()) not in (Runtime.STOPPED, Runtime.STOPPING),
        )

    def close(self) -> None:
        """Look no more. Idempotent, never raises."""
        receive, self._receive = self._receive, None
        if receive is not None:
            with suppress(RuntimeError):
                receive.disconnect()

    def _await_first(self) -> None:
        """Wait until the controller has told something twice: what it tells first may be of long ago."""
        end_ns = monotonic_ns() + round(FIRST_S * 1e9)
        first_s = self.see().plant_s
        while self.see().plant_s == first_s:
            if monotonic_ns() > end_ns:
                raise StaleStateError(
                    f"arm: expected its controller at {self._address} to tell of it, it tells nothing"
                )
            sleep(0.01)


def _vec6(values: Sequence[float]) -> Vec6:
    a, b, c, d, e, f = values
    return a, b, c, d, e, f


def _vec3(values: Sequence[float]) -> Vec3:
    return values[0], values[1], values[2]
