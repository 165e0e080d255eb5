"""What a control client must bear out before anything moves, the watchdog, payload and tool, and how it is ended."""

from collections.abc import Callable
from contextlib import suppress
from time import monotonic_ns

from dashboard_client import DashboardClient
from rtde_control import RTDEControlInterface
from rtde_receive import RTDEReceiveInterface

from config.arm import Tool
from robot.errors import ArmRefusedError
from robot.hal.protocols import Clock
from robot.hal.ur_state import Runtime, UrStatus, is_well, why_refused

__all__ = ["arm_watchdog", "end_program", "prove_watchdog", "require", "set_tool", "status_of"]

WATCHDOG_HZ = 10.0
"""Commands that come less often stop the program on the controller's side."""
PROOF_S = 0.5
"""Time on the controller's clock for what is set to be seen."""
STARVED_S = (0.06, 0.25)
"""After so long on the controller's clock an armed and starved watchdog ends its program: 100 ms, the client's own last
word and a state's delay. What ended it earlier was something else."""
PROOF_WALL_S = 5.0
PAYLOAD_TOLERANCE_KG, CENTRE_TOLERANCE_M, TCP_TOLERANCE = 0.05, 1e-4, 1e-4
END_S = 0.5
REASON_TICKS = 5


def status_of(receive: RTDEReceiveInterface) -> UrStatus:
    """Return what the controller said last of its modes."""
    return UrStatus(
        robot_mode=receive.getRobotMode(),
        safety_bits=receive.getSafetyStatusBits(),
        runtime=int(receive.getRuntimeState()),
        speed_fraction=receive.getTargetSpeedFraction(),
    )


def require(is_taken: bool, what: str, *, receive: RTDEReceiveInterface, clock: Clock) -> None:
    """Raise ArmRefusedError with the controller's reason where it did not take something."""
    if is_taken:
        return
    status = status_of(receive)
    for _ in range(REASON_TICKS):  # the reason may come a moment after the refusal
        if not is_well(status):
            break
        clock.wait_tick()
        status = status_of(receive)
    raise ArmRefusedError(f"{what}: the controller did not take it: {why_refused(status)}")


def arm_watchdog(control: RTDEControlInterface, receive: RTDEReceiveInterface, clock: Clock) -> None:
    """Have the controller end the program unless a command comes every 100 ms at least.

    Raises:
        ArmRefusedError: the controller did not take it.
    """
    require(control.setWatchdog(WATCHDOG_HZ), "setWatchdog", receive=receive, clock=clock)


def prove_watchdog(control: RTDEControlInterface, receive: RTDEReceiveInterface, clock: Clock) -> None:
    """Arm the controller's watchdog, starve it, and see the program end. Nothing has moved yet.

    Raises:
        ArmRefusedError: the program runs on, was ended by something else, or was not seen to run.
    """
    silent_ms, (earliest_s, latest_s) = 1e3 / WATCHDOG_HZ, STARVED_S
    deadline_ns = monotonic_ns() + round(PROOF_WALL_S * 1e9)
    _await_playing(receive, clock, deadline_ns)
    arm_watchdog(control, receive, clock)
    begun_s = receive.getTimestamp()
    while (gone_s := receive.getTimestamp() - begun_s) < latest_s and monotonic_ns() < deadline_ns:
        clock.wait_tick()
        status = status_of(receive)
        if status.runtime == Runtime.PLAYING:
            continue
        if not is_well(status, is_ended=True):
            raise ArmRefusedError(f"the arm was stopped while its watchdog was tried: {why_refused(status)}")
        if status.runtime != Runtime.STOPPED:
            continue
        if gone_s < earliest_s:
            raise ArmRefusedError(
                f"expected the controller's watchdog to end the program after {silent_ms:.0f} ms of silence, something "
                f"else did after {1e3 * gone_s:.0f} ms; look at its log"
            )
        return
    raise ArmRefusedError(
        f"expected the controller's watchdog to end a program that is silent for {silent_ms:.0f} ms, "
        f"it ran on for {latest_s:g} s: do not move this arm"
    )


def _await_playing(receive: RTDEReceiveInterface, clock: Clock, deadline_ns: int) -> None:
    """Wait until the program is seen to run: what has not begun cannot be seen to end.

    Raises:
        ArmRefusedError: it never was.
    """
    while (status := status_of(receive)).runtime != Runtime.PLAYING:
        if monotonic_ns() > deadline_ns:
            raise ArmRefusedError(f"expected the client's program to run, came: {why_refused(status)}")
        clock.wait_tick()


def end_program(
    control: RTDEControlInterface | None,
    receive: RTDEReceiveInterface,
    dashboard: DashboardClient,
    clock: Clock,
    is_ours: Callable[[], bool],
) -> bool:
    """End the client's program, and what a stop has only paused: nothing may go on by itself when that is released.

    Args:
        control: the client; None where it could not be made, which may have uploaded its program all the same.
        receive: tells what runs.
        dashboard: ends what runs, whosever it is.
        clock: the arm's ticks.
        is_ours: whether what runs now is not somebody else's.

    Returns:
        Whether it was seen to have ended. In local control nobody but a person at the pendant can end what is paused.
    """
    with suppress(RuntimeError):
        if control is not None:
            control.stopScript()
            if _await_end(receive, clock):
                return True
    is_asked = False
    if not is_ours():
        return False
    with suppress(RuntimeError):
        dashboard.stop()
        is_asked = True  # its answer comes before the state that shows it
    with suppress(RuntimeError):
        return _await_end(receive, clock, may_be_paused=is_asked)
    return False


def _await_end(receive: RTDEReceiveInterface, clock: Clock, *, may_be_paused: bool = False) -> bool:
    """Wait until no program runs. What is paused does not end by itself: it is waited for only if that may be past."""
    deadline_ns = monotonic_ns() + round(END_S * 1e9)
    while (runtime := status_of(receive).runtime) != Runtime.STOPPED:
        is_paused = runtime in (Runtime.PAUSING, Runtime.PAUSED)
        if monotonic_ns() > deadline_ns or (is_paused and not may_be_paused):
            return False
        clock.wait_tick()
    return True


def set_tool(control: RTDEControlInterface, receive: RTDEReceiveInterface, clock: Clock, tool: Tool) -> None:
    """Set payload, its mass and centre, and tool centre point, and read them back.

    A payload that the controller reckons with already is not told again, for to be told one zeroes the force sensor:
    the weight of something else on the flange, for which the first motion waits, would be gone from what it reads.

    Raises:
        ArmRefusedError: the controller has others.
    """
    tcp = [*tool.tcp_m, 0.0, 0.0, 0.0]
    if not carries(receive, tool):
        require(control.setPayload(tool.mass_kg, list(tool.com_m)), "setPayload", receive=receive, clock=clock)
    require(control.setTcp(tcp), "setTcp", receive=receive, clock=clock)
    if any(abs(a - b) > TCP_TOLERANCE for a, b in zip(control.getTCPOffset(), tcp, strict=True)):
        raise ArmRefusedError(f"expected tool centre point {tcp}, the controller says {control.getTCPOffset()}")
    deadline_ns = monotonic_ns() + round(PROOF_S * 1e9)
    while not carries(receive, tool):
        if monotonic_ns() > deadline_ns:
            raise ArmRefusedError(
                f"expected payload {tool.mass_kg} kg at {[*tool.com_m]} m of the flange, "
                f"the controller says {receive.getPayload()} kg at {receive.getPayloadCog()} m"
            )
        clock.wait_tick()


def carries(receive: RTDEReceiveInterface, tool: Tool) -> bool:
    """Return whether the controller reckons with a tool's mass and centre of mass."""
    off_m = [abs(a - b) for a, b in zip(receive.getPayloadCog(), tool.com_m, strict=True)]
    return abs(receive.getPayload() - tool.mass_kg) <= PAYLOAD_TOLERANCE_KG and max(off_m) <= CENTRE_TOLERANCE_M
