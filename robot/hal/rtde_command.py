"""Command of an arm over RTDE: the client whose program obeys, and the outputs, from taking it to giving it up.

The client uploads a script and stops whatever program runs, so it is made when somebody takes command, after arming. It
never outlives a stop or a stale state, because it would go on by itself where it was left: it repeats a command after a
reconnection, and the script acts on the registers' last values.
"""

from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from time import monotonic_ns
from typing import TypeAlias

from dashboard_client import DashboardClient
from rtde_control import RTDEControlInterface
from rtde_receive import RTDEReceiveInterface

from config.arm import Servo, Tool
from robot.errors import ArmRefusedError, StaleStateError
from robot.hal.obedience import LOOK_TICKS, Obedience
from robot.hal.pins import Pins
from robot.hal.primary_watch import PrimaryWatch
from robot.hal.programs_told import OURS
from robot.hal.protocols import Clock
from robot.hal.rtde_links import RtdeLinks
from robot.hal.rtde_outputs import N_OUTPUTS, DigitalOutputs
from robot.hal.rtde_probe import probe_upload
from robot.hal.rtde_set_up import arm_watchdog, carries, end_program, prove_watchdog, set_tool
from robot.hal.ur_calls import bounded
from robot.hal.ur_state import Runtime
from robot.messages import Vec6

__all__ = ["ALL_BITS", "RATE_HZ", "TAKE_S", "Readers", "RtdeCommand"]

RATE_HZ = 500.0
TAKE_S = 8.0
"""Longer than the client takes to be made, or to give up. One that lost its link meanwhile may wait for ever."""
WRITE_NS = 35_000_000
"""A command that took longer was no mere sending: the client may have reconnected in it, which takes 40 ms at least."""
ALL_BITS = (1 << N_OUTPUTS) - 1

PRIMARY_TICKS = 5
"""Of 2 ms, between two looks at who has started something on the controller."""
SET_UP_S = 4.0
"""Longer than the watchdog's proof takes, and what is set: a call that another program came amid waits for 300 s."""
PLAYING_NS, BEGUN_NS, TOLD_NS = 5_000_000_000, 1_000_000_000, 300_000_000
"""How long an upload is waited for to begin, where it is to be used and where to be ended, and what the state shows
already to be told by name."""
STOP_RAD_S2, STOP_S = 10.0, 2.0
"""How an arm that is told to stop brakes, and how long the client may take over it: where another program came up
meanwhile it would wait 300 s for that one's answer."""

Readers: TypeAlias = tuple[RTDEReceiveInterface, DashboardClient]


class RtdeCommand:
    """What holds command of one arm.

    Args:
        address: host or IP address of the controller.
        tool: what the controller has to reckon with.
        links: of this arm's clients.
        pins: the control box's wiring.
        readers: returns the clients that read, once there are any.

    Attributes:
        control: The client whose program obeys; None while nobody has command.
        outputs: The outputs it drives; likewise.
    """

    def __init__(
        self, *, address: str, tool: Tool, links: RtdeLinks, pins: Pins, readers: Callable[[], Readers]
    ) -> None:
        self._address, self._tool = address, tool
        self._links, self._pins, self._readers = links, pins, readers
        self.control: RTDEControlInterface | None = None
        self.outputs: DigitalOutputs | None = None
        self._primary = PrimaryWatch(address, tool=(*tool.tcp_m, 0.0, 0.0, 0.0))
        self._obedience, self._n_looks = Obedience(), 0
        self._is_taken = False
        """Command was taken whole: the program that obeys is known to be ours."""
        self._was_seen = self._has_ended = self._was_replaced = False
        """Our program was seen to run since it was uploaded, and to have ended: what runs after that is not ours."""

    def take(self, clock: Clock) -> None:
        """Upload the program, have its watchdog proven, upload it anew, set payload and tool, arm the watchdog last.

        The link of the client that reads is watched already.

        Args:
            clock: the arm's ticks.

        Raises:
            ArmRefusedError: the controller did not take something, its watchdog does not work, or somebody started a
                program meanwhile.
            StaleStateError: a link was lost.
            WireError: a port that is needed does not answer.
            RuntimeError: the client's own.
        """
        receive, _ = self._readers()
        self._is_taken = False
        self._links.begin_guard(receive.getTimestamp)
        self._primary.begin(clock)
        self.control = self._connected(clock)
        self._await_ours(clock)
        try:
            with self._in_time(SET_UP_S):
                prove_watchdog(self.control, receive, clock)
        except ArmRefusedError:
            self._require_unchanged()  # that somebody's program came amid it says more
            raise
        self._links.require()
        self._links.pause()
        self.control = None
        self._links.look()
        self.control = self._connected(clock)
        self._await_ours(clock)
        self._set_up(self.control, receive, clock)
        self._links.require()
        self._was_seen = self._is_taken = True  # it carried out what it was set up with

    def note(self, runtime: int) -> None:
        """Take note of a runtime state that was read: of our program's, once that was seen to run."""
        self._was_seen |= self.control is not None and runtime == Runtime.PLAYING
        self._has_ended |= self._was_seen and runtime in (Runtime.STOPPING, Runtime.STOPPED)

    def is_replaced(self) -> bool:
        """Look whether somebody else's program runs where ours did: it is not ours to end, and answers us nothing."""
        if self.control is None:
            return False
        changed, runtime = self._primary.look(), Runtime.STOPPED
        with suppress(RuntimeError):  # the client throws it where it has no state
            runtime = int(self._readers()[0].getRuntimeState())
        is_foreign = changed is not None and changed[0]
        self._note_replaced(is_foreign or (self._has_ended and runtime == Runtime.PLAYING))
        return self._links.is_lost

    def _note_replaced(self, is_so: bool) -> None:
        """Take note that what runs there now is not ours to end; a drive's coil that we gave current is."""
        self._links.is_lost |= is_so
        if is_so and not self._was_replaced:
            self._was_replaced = True
            self._rest_outputs()

    def brake(self) -> None:
        """Have our program bring the joints to rest, where it has not ended. Taken or not: rest is to be looked at."""
        if self.control is not None and not self._has_ended:
            with suppress(RuntimeError), self._in_time(STOP_S):
                self.control.servoStop(STOP_RAD_S2)

    def require_ours(self, sent_rad: Vec6) -> None:
        """Look at one part of what may change on a controller while our program seems to run; called every tick.

        Args:
            sent_rad: where the controller was asked to bring the joints last.

        Raises:
            ArmRefusedError: somebody's program has replaced ours, tool or payload is another, or nobody obeys.
        """
        self._n_looks += 1
        if self._n_looks % PRIMARY_TICKS == 0:
            changed = self._primary.look()
            if changed is not None:
                is_foreign, what = changed
                self._note_replaced(is_foreign)
                raise ArmRefusedError(f"arm: {what}")
        elif self._n_looks % LOOK_TICKS == 1:
            receive, _ = self._readers()
            astray = self._obedience.check(sent_rad, receive.getTargetQ())
            if astray is not None:
                raise ArmRefusedError(f"servoJ: {astray}")
            if not carries(receive, self._tool):
                raise ArmRefusedError(
                    f"arm: somebody set another payload on its controller: {receive.getPayload()} kg at "
                    f"{receive.getPayloadCog()} m of the flange, expected {self._tool.mass_kg} kg at "
                    f"{[*self._tool.com_m]} m"
                )

    def servo(self, q_rad: Vec6, servo: Servo) -> bool:
        """Send joints to servo to. Returns whether the client says that it did.

        Raises:
            StaleStateError: sending took so long that the client may have reconnected, or it threw.
        """
        assert self.control is not None, "take made it"
        begun_ns = monotonic_ns()
        try:
            is_taken = self.control.servoJ(list(q_rad), 0.0, 0.0, 1.0 / RATE_HZ, servo.lookahead_s, servo.gain)
        except RuntimeError as error:
            raise self._thrown("servoJ", error) from error
        spent_ns = monotonic_ns() - begun_ns
        if spent_ns > WRITE_NS:
            self._links.is_lost = True
            raise StaleStateError(
                f"servoJ: expected it sent within {WRITE_NS / 1e6:g} ms, it took {spent_ns / 1e6:.0f} ms; the client "
                "may have reconnected by itself"
            )
        return is_taken

    def put(self, signals: int) -> int | None:
        """Switch the outputs that differ; return the first terminal that the controller did not take, None for none.

        Raises:
            StaleStateError: the client threw.
        """
        assert self.outputs is not None, "take made it"
        try:
            return self.outputs.put(self._pins.pins_out(signals, self.outputs.bits, now_ns=monotonic_ns()))
        except RuntimeError as error:
            raise self._thrown("digital outputs", error) from error

    def strayed(self, read: int) -> int | None:
        """Return the first terminal that does not follow, by what was read of all; see DigitalOutputs."""
        assert self.outputs is not None, "take made it"
        return self.outputs.strayed(read, self._pins.output_mask, now_ns=monotonic_ns())

    def drop(self, clock: Clock, *, is_in_traceback: bool = False) -> bool:
        """End the program and forget its client: it must never get the chance to go on by itself.

        A client disconnects when its last reference goes, and sleeps half a second each time it does. So it is told to
        only where a traceback keeps it alive. Until it goes its link is watched: one that was lost is kept.

        Returns:
            Whether the program has ended, and no coil of a drive is left with current.
        """
        is_taken, self._is_taken = self._is_taken, False
        with suppress(RuntimeError, StaleStateError):
            self._await_begun(clock)
        is_replaced = self.is_replaced()
        if is_replaced:
            self._primary.close()
            return False
        is_ended = self._end(clock) if is_taken else self._end_by_name(clock)
        is_ended = self._rest_outputs() and is_ended
        self._primary.close()
        outputs, self.outputs = self.outputs, None
        if self._links.is_lost_now:
            return False
        self._links.forget()
        if outputs is not None:
            outputs.close()
        control, self.control = self.control, None
        if control is not None and is_in_traceback:
            with suppress(RuntimeError):
                control.disconnect()
        return is_ended

    def _rest_outputs(self) -> bool:
        """Leave no coil of a drive with current, and return whether that was sent: outputs have a link of their own."""
        outputs = self.outputs
        if outputs is None:
            return True
        with suppress(RuntimeError), self._in_time(STOP_S):
            return outputs.put(self._pins.rested(outputs.bits)) is None
        return False

    def _end(self, clock: Clock) -> bool:
        """End the program that runs, where it is ours. Returns whether none is left."""
        receive, dashboard = self._readers()
        with self._in_time(STOP_S):
            return end_program(self.control, receive, dashboard, clock, self._is_ours)

    def _is_ours(self) -> bool:
        """Look whether what runs is ours: by name, or because nobody has replaced what was known to be."""
        is_replaced = self.is_replaced()
        return not is_replaced and (self._was_seen or self._primary.told.is_ours)

    def _end_by_name(self, clock: Clock) -> bool:
        """End what was uploaded on a way that was broken off: until it is told by name to have ended, it has not.

        That no program runs at an instant says little here: ours may be about to begin. What was uploaded and not told
        to have begun is not waited for again.
        """
        told = self._primary.told
        if not told.may_be_ours:
            return True
        is_ended, end_ns = self._end(clock), monotonic_ns() + TOLD_NS
        while is_ended and told.is_ours and self._primary.is_open and monotonic_ns() < end_ns:
            clock.wait_tick()
            self._primary.look()
        return is_ended and not told.may_be_ours

    def end(self) -> None:
        """End the clients that a lost link has left, where this process goes on: they would go on by themselves."""
        self._primary.close()
        control, self.control = self.control, None
        outputs, self.outputs = self.outputs, None
        if outputs is not None:
            outputs.close()
        if control is not None:
            with suppress(RuntimeError):
                control.disconnect()
        self._links.forget()

    def _thrown(self, what: str, error: RuntimeError) -> StaleStateError:
        """Note that the link is lost, and return the error that says so: a client throws where it cannot reconnect."""
        self._links.is_lost = True
        return StaleStateError(f"{what}: expected it sent, the client lost its link and does not get it back: {error}")

    def _connected(self, clock: Clock) -> RTDEControlInterface:
        probe_upload(self._address)
        self._require_nobodys(clock)
        self._links.when_uploading()
        self._was_seen = self._has_ended = self._was_replaced = False
        self._primary.told.expect()
        with self._in_time():
            control = RTDEControlInterface(self._address, RATE_HZ, RTDEControlInterface.FLAG_UPLOAD_SCRIPT)
        self._links.look()
        return control

    def _in_time(self, limit_s: float = TAKE_S) -> AbstractContextManager[None]:
        """Bound what may hang by this process's end, where it may end."""
        return bounded(limit_s if self._links.when_lost is not None else None)

    def _set_up(self, control: RTDEControlInterface, receive: RTDEReceiveInterface, clock: Clock) -> None:
        """Set payload and tool centre point, open the outputs, listen to what changes, arm the watchdog last."""
        with self._in_time(SET_UP_S):
            set_tool(control, receive, clock, self._tool)
        with self._in_time():
            self.outputs = DigitalOutputs(self._address, bits=receive.getActualDigitalOutputBits() & ALL_BITS)
        self._links.look()
        self._pins.forget()
        self._obedience.seed()
        self._primary.mind_tool(clock)
        self._require_unchanged()
        with self._in_time(SET_UP_S):
            arm_watchdog(control, receive, clock)  # from here on somebody must write
        self._require_unchanged()

    def _require_nobodys(self, clock: Clock) -> None:
        """Look that no program runs: to be made, the client stops whatever does.

        Raises:
            ArmRefusedError: one does, or somebody started one.
        """
        receive, _ = self._readers()
        self._require_unchanged()
        if int(receive.getRuntimeState()) in (Runtime.STOPPING, Runtime.STOPPED):
            return
        end_ns = monotonic_ns() + TOLD_NS
        while monotonic_ns() < end_ns:  # its name may come after the state that shows it
            self._require_unchanged()
            clock.wait_tick()
        running = self._primary.told.running
        which = "one" if running is None else repr(running)
        raise ArmRefusedError(
            f"arm: expected no program on its controller, {which} is running: whoever started it must stop it"
        )

    def _await_ours(self, clock: Clock) -> None:
        """Wait until the controller tells that our program has begun: that one runs does not say whose it is.

        Raises:
            ArmRefusedError: it does not, or somebody started another.
        """
        self._await_begun(clock, within_ns=PLAYING_NS)
        self._require_unchanged()
        told = self._primary.told
        if not told.is_ours:
            raise ArmRefusedError(
                f"arm: expected its controller to tell on the primary interface that {OURS!r} was started, came: "
                f"{'nothing' if told.n_due else 'that it has ended'}"
            )

    def _await_begun(self, clock: Clock, *, within_ns: int = BEGUN_NS) -> None:
        """Hear what has begun; what of ours was uploaded and has not is waited for, for a while."""
        self._primary.look()
        end_ns = monotonic_ns() + within_ns
        while self._primary.told.n_due > 0 and self._primary.is_open and monotonic_ns() < end_ns:
            clock.wait_tick()
            self._primary.look()

    def _require_unchanged(self) -> None:
        """Raise ArmRefusedError where somebody changed something since it is listened, or nothing is heard any more."""
        changed, told = self._primary.look(), self._primary.told
        if told.foreign is not None:
            now = "runs there" if told.running == told.foreign else "has ended: our client ends what begins amid this"
            raise ArmRefusedError(
                f"arm: somebody started the program {told.foreign!r} on its controller while command was taken; it "
                f"{now}"
            )
        if changed is not None:
            raise ArmRefusedError(f"arm: {changed[1]}")
