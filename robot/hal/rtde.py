"""A UR5e over RTDE: the genuine ur_rtde client behind the Arm door. PolyScope 5.

Connecting reads only: the receive and dashboard clients. The control client stops whatever program runs and never
outlives a stop or a stale state (robot/hal/rtde_command.py): whoever wants to move makes a new one, by `engage`, after
somebody has armed. Where the link was lost the client is not even told to stop, for any word to it may make it
reconnect: the controller's watchdog stops the arm, and the process has to end. A guard sees to that where nobody ticks:
between engaging and the first command, and while the arm is stopped.
"""

from collections.abc import Callable
from contextlib import suppress
from time import monotonic_ns

from dashboard_client import DashboardClient
from rtde_receive import RTDEReceiveInterface

from config.arm import ArmConfig
from config.cell import CellConfig
from robot.errors import ArmRefusedError, NotEngagedError, StaleStateError, WireError
from robot.geometry import quat_of_rotation_vector, vec6
from robot.hal.pins import Pins
from robot.hal.protocols import Clock
from robot.hal.robotiq import GripScale, RobotiqGripper
from robot.hal.rtde_clock import HeedingClock, RtdeClock
from robot.hal.rtde_command import ALL_BITS, RATE_HZ, TAKE_S, Readers, RtdeCommand
from robot.hal.rtde_links import RtdeLinks
from robot.hal.rtde_outputs import N_OUTPUTS
from robot.hal.rtde_probe import probe_rtde
from robot.hal.rtde_set_up import require, status_of
from robot.hal.ur_calls import bounded, named
from robot.hal.ur_identity import identify
from robot.hal.ur_state import (
    Runtime,
    UrStatus,
    check_ready,
    mode_of,
    why_refused,
    why_slowed,
)
from robot.messages import ArmCommand, ArmMode, ArmSpec, ArmState, GripState

__all__ = ["RtdeArm"]

FIELDS = (
    "timestamp", "actual_q", "actual_qd", "actual_TCP_pose", "actual_TCP_speed",
    "actual_TCP_force", "actual_digital_input_bits",
    "actual_digital_output_bits", "robot_mode", "runtime_state", "safety_status_bits", "target_speed_fraction",
    "payload", "payload_cog", "target_q",
)  # fmt: skip
"""All that is read here. Left to itself the client asks for 58 and more, which the controller would pack, and a thread
beside the servo loop unpack, 500 times a second."""
STALE_NS = 40_000_000
"""A state that stands still so long is lost. It is to be noticed within 50 ms: on top of this come the tick of 2 ms
that looks, the one in which the controller last sent, and what a busy machine adds to either."""
PAUSE_NS, HAND_NS = 50_000_000, 40_000_000
"""After such a pause what the hand said last is of before; and so long its next word is waited for."""
REST_S, STILL_RAD_S = 1.0, 0.01
START_S = 2.0
NOT_ENDED = "and nobody confirms that the program has ended which was to obey: look at the arm's pendant"


class RtdeArm:
    """One UR5e with a Robotiq hand (robot.hal.protocols.Arm)."""

    def __init__(
        self, *, arm: ArmConfig, address: str, serial: str | None = None, cell: CellConfig | None = None
    ) -> None:
        """Store. Nothing is acquired.

        Args:
            arm: the arm's file.
            address: host or IP address of the controller.
            serial: the number that it must say it has; None takes any.
            cell: where the control box has the table's signals; straight through where None.
        """
        joints = arm.joints
        self.spec = ArmSpec(
            model=arm.name, rate_hz=RATE_HZ, n_inputs=N_OUTPUTS, n_outputs=N_OUTPUTS,
            q_min_rad=vec6([j.range_rad[0] for j in joints]), q_max_rad=vec6([j.range_rad[1] for j in joints]),
            qd_max_rad_s=vec6([j.speed_rad_s for j in joints]), grip_stroke_m=arm.tool.stroke_m,
        )  # fmt: skip
        self._pace = RtdeClock()
        self.clock: Clock = self._pace
        self.address = address
        self.serial = ""
        """As the controller says, from connect() on."""
        self._arm, self._expected_serial = arm, serial
        self._receive: RTDEReceiveInterface | None = None
        self._dashboard: DashboardClient | None = None
        self._gripper = RobotiqGripper(GripScale.of(arm.tool))
        self._last_timestamp, self._seen_ns, self._polled_ns = -1.0, 0, 0
        self._pins = Pins(cell)
        self.links = RtdeLinks(address)
        """Who may end this process is set on them."""
        self._command = RtdeCommand(
            address=address, tool=arm.tool, links=self.links, pins=self._pins, readers=self._reading
        )
        self._runtime, self._speed_fraction = Runtime.STOPPED, 1.0
        """As the last state read told."""
        self._modes, self._mode = (-1, 0), mode_of(-1, 0)
        self._outputs_read = 0
        self._is_hand_asked = False
        self.is_stopped: Callable[[], bool] = lambda: False

    # ----------------------------------------------------------------------------------------------------- acquire

    def connect(self) -> None:
        """Open the clients that read, and check that this is the arm of the file. Moves nothing, stops nothing.

        Raises:
            WireError: somebody does not answer, the hand among them.
            StaleStateError: the controller's own time stands still.
            RobotConfigError: another arm than the rig names, another model or software than this backend is for.
            ArmRefusedError: the arm is stopped, and its hand without power.
        """
        if self._receive is not None:
            return
        known = identify(address=self.address, arm=self._arm, serial=self._expected_serial)
        self.serial = known.serial
        probe_rtde(self.address)
        with named("RTDE", self.address), bounded(TAKE_S if self.links.when_lost is not None else None):
            self._receive = RTDEReceiveInterface(self.address, RATE_HZ, list(FIELDS))
        self._dashboard = known.dashboard
        self._gripper.connect(self.address)
        self._pace.pace_by(self._receive)
        self._wait_first_state()

    def engage(self) -> None:
        """Take command of the arm, unless it is ours already. Nothing moves yet but a hand that needs activating.

        That hand is waited for, some seconds.

        Raises:
            ArmRefusedError: the arm is not ready, or belongs to somebody else, or its watchdog does not work.
            StaleStateError: this process lost its link, before or now; or what it began is not confirmed to have ended.
            WireError: somebody does not answer.
        """
        if self.links.is_lost:
            raise StaleStateError("arm: expected a process that never lost its link; end this one and start another")
        if self._command.control is not None:
            return
        _, dashboard = self._reading()
        with named("dashboard", self.address):
            dashboard.disconnect()  # one that was made in local control obeys nobody in remote control either
            dashboard.connect()
            is_remote = bool(dashboard.isInRemoteControl())
        check_ready(self.status(), is_remote=is_remote)
        try:
            self.links.look()
            self._wake_hand()
            check_ready(self.status(), is_remote=is_remote)  # somebody may have begun something meanwhile
        except BaseException:
            self.links.forget()
            raise
        try:
            with named("RTDE control", self.address):
                self._command.take(HeedingClock(self.clock, self._heed_stop))
        except BaseException as error:
            # An arm that was set up by half is nobody's: the next engage begins anew, where the program has ended.
            self._require_link()
            if self._command.drop(self.clock, is_in_traceback=True):
                raise
            self.links.is_lost = True
            raise StaleStateError(f"{error or type(error).__name__}; {NOT_ENDED}") from error

    # ------------------------------------------------------------------------------------------------ read and write

    def read(self) -> ArmState:
        """Return the newest state.

        Raises:
            StaleStateError: not connected, the link was cut, or the controller's own time has stood still for 40 ms.
            ArmRefusedError: the hand does not answer because the arm is stopped: where drives are cut it has no power.
            WireError: the hand does not answer.
        """
        receive, _ = self._reading()
        self._require_link()
        self._note_freshness(receive)
        grip = self._grip_where_powered()
        self._runtime, self._speed_fraction = int(receive.getRuntimeState()), receive.getTargetSpeedFraction()
        self._command.note(self._runtime)
        modes = receive.getRobotMode(), receive.getSafetyStatusBits()
        if modes != self._modes:
            self._modes, self._mode = modes, mode_of(*modes)
        self._outputs_read = receive.getActualDigitalOutputBits() & ALL_BITS
        x, y, z, rx, ry, rz = receive.getActualTCPPose()
        vx, vy, vz, _, _, _ = receive.getActualTCPSpeed()
        fx, fy, fz, _, _, _ = receive.getActualTCPForce()
        j1, j2, j3, j4, j5, j6 = receive.getActualQ()
        s1, s2, s3, s4, s5, s6 = receive.getActualQd()
        return ArmState(
            stamp_ns=self._seen_ns,
            q_rad=(j1, j2, j3, j4, j5, j6),
            qd_rad_s=(s1, s2, s3, s4, s5, s6),
            tcp_position_m=(x, y, z),
            tcp_quat=quat_of_rotation_vector(rx, ry, rz),
            tcp_speed_m_s=(vx, vy, vz),
            tcp_force_n=(fx, fy, fz),
            grip=grip,
            digital_in=self._pins.signals_in(receive.getActualDigitalInputBits() & ALL_BITS),
            digital_out=self._pins.signals_out(self._outputs_read),
            mode=self._mode,
        )

    def write(self, command: ArmCommand) -> None:
        """Send joint targets, and grip and outputs where they changed. Only the gate calls this.

        Raises:
            NotEngagedError: nobody took command, or the arm was stopped since.
            ArmRefusedError: the program that obeys has ended or was replaced, the controller did not take it or steers
                for something else, somebody has slowed the arm down meanwhile or changed its tool or payload, or an
                output does not follow.
            StaleStateError: the link was cut, the client threw, or it took so long that it may have reconnected.
            WireError: the hand does not answer.
        """
        if self._command.control is None:
            raise NotEngagedError("arm: expected connect() and engage() before write(), and again after a stop")
        self._require_link()
        if self._runtime != Runtime.PLAYING:
            self._refuse("servoJ")
        slowed = why_slowed(self._modes[1], self._speed_fraction)
        if slowed is not None:
            raise ArmRefusedError(f"servoJ: {slowed}")
        self._command.require_ours(command.q_rad)
        if not self._command.servo(command.q_rad, self._arm.servo):
            self._refuse("servoJ")
        self._gripper.command(command.grip)
        untaken = self._command.put(command.digital_out)
        if untaken is not None:
            self._refuse(f"digital output {untaken}")
        strayed = self._command.strayed(self._outputs_read)
        if strayed is not None:
            raise ArmRefusedError(
                f"digital output {strayed}: expected it as it was asked, it is not: who else switches it? A program, "
                "or an I/O action of the installation, say"
            )
        self._ask_hand()

    def stop(self) -> bool:
        """Bring arm and fingers to rest and give up command; a hand that holds something goes on holding it.

        An activation under way is taken back. Where the link was lost nothing is sent to the arm: the controller's
        watchdog stops it.

        Returns:
            Whether rest was seen, and that the program has ended. Where not, this process must end.
        """
        self.abandon()
        if self.links.is_lost_now or self._command.is_replaced():
            return False
        self._command.brake()
        is_resting = self._wait_rest()
        if self.links.is_lost_now:
            return False
        return self._command.drop(self.clock) and is_resting

    def abandon(self) -> None:
        """Stop the fingers: their wire is another than the arm's, and may be spoken on whatever became of that one."""
        with suppress(WireError):
            self._gripper.halt()

    def close(self) -> None:
        """Stop, and close every client. Idempotent, never raises."""
        if self._receive is None:
            return
        self.stop()
        if self.links.when_lost is None:
            self._command.end()
        self._pace.pace_by(None)
        dashboard, self._receive, self._dashboard = self._dashboard, None, None  # see RtdeCommand.drop
        with suppress(RuntimeError):
            if dashboard is not None:
                dashboard.disconnect()
        self._gripper.close()

    def status(self) -> UrStatus:
        """Return what the controller said last of its modes."""
        receive, _ = self._reading()
        return status_of(receive)

    # -------------------------------------------------------------------------------------------------------- inside

    def _require_link(self) -> None:
        self.links.require()

    def _reading(self) -> Readers:
        if self._receive is None or self._dashboard is None:
            raise StaleStateError("arm: expected connect() before read(); nothing was read")
        return self._receive, self._dashboard

    def _note_freshness(self, receive: RTDEReceiveInterface) -> None:
        """Judge age by the controller's own time: the client says connected, and serves old data, after a drop."""
        timestamp, now_ns = receive.getTimestamp(), monotonic_ns()
        if timestamp > self._last_timestamp:  # not one that is no number, nor one of before
            self._last_timestamp, self._seen_ns = timestamp, now_ns
        elif now_ns - self._seen_ns > STALE_NS:
            age_ms = (now_ns - self._seen_ns) / 1e6
            self.links.is_lost |= self._command.control is not None
            raise StaleStateError(
                f"arm: expected a state every 2 ms, the newest is {age_ms:.0f} ms old; is the link up?"
            )

    def _ask_hand(self) -> None:
        """Let the hand have its turn after the command has gone out, and none in the next read."""
        self._gripper.poll()
        self._is_hand_asked = True

    def _wake_hand(self) -> None:
        """Have the hand activated, where it is not."""
        self._polled_ns = 0  # what it said before counts no more
        self.read()
        if not self._gripper.is_active:
            self._gripper.activate(self._see_running)

    def _grip_where_powered(self) -> GripState:
        """Return what the hand says; of an arm that does not run the stop is told, not the hand that it leaves dead."""
        try:
            return self._grip_now()
        except StaleStateError:
            raise
        except WireError as error:
            self._refuse_unpowered(error)
            raise

    def _refuse_unpowered(self, error: WireError) -> None:
        """Raise for the arm's stop, where it is stopped, in place of what its hand's silence is told by."""
        status = self.status()
        if mode_of(status.robot_mode, status.safety_bits) is not ArmMode.RUNNING:
            why = why_refused(status)
            raise ArmRefusedError(f"arm: expected it running and its hand powered, came: {why}; {error}") from error

    def _grip_now(self) -> GripState:
        """Return what the hand says; after a pause wait for what it says now, the next answer being of before."""
        now_ns, hand = monotonic_ns(), self._gripper
        is_late, self._polled_ns = now_ns - self._polled_ns > PAUSE_NS, now_ns
        is_asked, self._is_hand_asked = self._is_hand_asked, False
        if is_late:
            fresh, deadline_ns = hand.n_answers + 2, now_ns + HAND_NS
            while hand.n_answers < fresh and monotonic_ns() < deadline_ns:
                hand.poll(is_awaited=True)
                self.clock.wait_tick()
        grip = hand.state if is_asked else hand.poll()
        if grip is None:
            raise StaleStateError("arm: expected a state of the hand, none came yet")
        return grip

    def _wait_first_state(self) -> None:
        deadline_ns = monotonic_ns() + round(START_S * 1e9)
        while True:
            try:
                self.read()
            except StaleStateError as error:
                if monotonic_ns() > deadline_ns:
                    self._blame_hand(error)
                    raise
                self.clock.wait_tick()
            else:
                return

    def _blame_hand(self, error: StaleStateError) -> None:
        """Raise for the hand, where only its state is missing: no other process would hear more of it than this one."""
        if self._gripper.state is not None:
            return
        self._note_freshness(self._reading()[0])
        mute = WireError(
            f"gripper: expected its position and whether it holds something within {START_S:g} s of connecting, came "
            "neither; has the tool power, is it plugged in, and does its page on the pendant show it?"
        )
        self._refuse_unpowered(mute)
        raise mute from error

    def _see_running(self) -> None:
        """Wait a tick and look at arm and hand; where the arm may not move the hand may not either."""
        self.clock.wait_tick()
        self._heed_stop()
        if self.read().mode is not ArmMode.RUNNING:
            raise ArmRefusedError(f"hand: its activation was broken off: {why_refused(self.status())}")

    def _heed_stop(self) -> None:
        """Raise ArmRefusedError where somebody said stop while command is taken."""
        if self.is_stopped():
            raise ArmRefusedError("arm: somebody said stop while command was taken: nothing is begun")

    def _refuse(self, what: str) -> None:
        require(False, what, receive=self._reading()[0], clock=self.clock)

    def _wait_rest(self) -> bool:
        """Wait until the joints rest, at most REST_S, whatever the hand says. Returns whether they do."""
        receive, deadline_ns = self._receive, monotonic_ns() + round(REST_S * 1e9)
        if receive is None:
            return True
        with suppress(WireError, RuntimeError):  # the client throws the latter where it has no state
            while monotonic_ns() < deadline_ns:
                self._require_link()
                self._note_freshness(receive)
                self.clock.wait_tick()
                if max(abs(v) for v in receive.getActualQd()) < STILL_RAD_S:
                    return True
        return False
