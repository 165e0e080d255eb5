"""A shadow over a recorded session: as if it had run beside the plant then. The edge to the file."""

from collections.abc import Callable
from pathlib import Path

import msgspec

from config.fitted import FittedPlant
from robot.bus.topics import ARM_STATE, PERCEPT, SENT
from robot.messages import ArmState
from robot.recording.origin import resolved_of
from robot.recording.session_file import SessionFile
from robot.recording.topics import EVENT, RESET_MARK
from sim_twin.shadowing.beside import Bounds, TwinBeside

__all__ = ["shadow_session"]


def shadow_session(
    path: Path, *, fitted: FittedPlant | None = None, bounds: Bounds | None = None,
    look: Callable[[TwinBeside], object] = lambda _: None,
) -> TwinBeside:  # fmt: skip
    """Let a twin follow a session's commands to its end, or to the first bound that is passed.

    Args:
        path: of the session.
        fitted: what is known of the arm; what its file says if left out.
        bounds: that latch.
        look: is called after every tick.

    Raises:
        UnfitError: it has no config.
        DamagedError: it is torn.
    """
    with SessionFile(path) as session:
        resolved = resolved_of(session)
        if fitted is not None:
            resolved = msgspec.structs.replace(resolved, arm=msgspec.structs.replace(resolved.arm, fitted=fitted))
        beside = TwinBeside(resolved, bounds=bounds)
        state: ArmState | None = None
        for topic, _, message in session.messages(ARM_STATE, SENT, PERCEPT, RESET_MARK, EVENT):
            if topic is ARM_STATE:
                state = message
            elif topic is PERCEPT:
                beside.see(message)
            elif topic is not SENT:
                beside.begin_anew()
            elif state is not None:
                beside.take(state, message)
                state = None
                look(beside)
                if beside.latched is not None:
                    break
    return beside
