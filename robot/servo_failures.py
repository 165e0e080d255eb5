"""What a station is told where its servo process failed: a time step that came to nothing, or an error."""

from robot import errors
from robot.errors import RobotError, WireError
from robot.messages import ArmState, Outcome, Verdict
from robot.safety import Reason
from robot.servo_messages import Failure
from robot.tick_loop import Stride

__all__ = ["cut_short", "error_of"]


def cut_short(state: ArmState, why: str) -> Stride:
    """Return the time step that a process which is gone came to, as far as anybody knows: nothing."""
    verdict = Verdict(
        stamp_ns=state.stamp_ns, sequence=-1, outcome=Outcome.REFUSED, reason=Reason.STALE_STATE.value, detail=why,
        is_latched=True,
    )  # fmt: skip
    return Stride(
        before=state, after=state, is_begun=False, target_m=state.tcp_position_m, limiters=(), is_in_contact=False,
        verdict=verdict,
    )  # fmt: skip


def error_of(failure: Failure) -> RobotError:
    """Return the error that the process raised, or its nearest kind."""
    kind = getattr(errors, failure.kind, WireError)
    return kind(failure.message)
