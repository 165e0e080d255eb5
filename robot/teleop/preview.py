"""Intents are tried on a shadow of the world first, and sent a little later: what latches there is not sent."""

from collections import deque
from typing import Protocol

from robot.messages import ArmState, Hold, Intent, Percept, Verdict

__all__ = ["AheadPreview", "Shadow"]


class Shadow(Protocol):
    """A simulated copy of the world that intents may be tried on."""

    def begin(self, measured: ArmState, percept: Percept) -> None:
        """Be, at rest, where the arm is and where things are perceived."""
        ...

    def attempt(self, intent: Intent, duration_s: float) -> Verdict | None:
        """Carry an intent out and return the verdict that stopped it, None where none did."""
        ...

    def close(self) -> None:
        """Give it back. Idempotent."""
        ...


class AheadPreview:
    """Implements Preview. The shadow is some steps ahead of the arm: what stops it there, the arm has not come to yet.

    A Hold goes through at once and forgets what was waiting, so that letting go is never late. After a refusal nothing
    is sent until the driver has let go; the shadow's own latch is no stop of the arm, and is nobody's to clear.

    Args:
        shadow: what intents are tried on.
        n_ahead: steps that it is ahead.
        step_s: how long a step is.
    """

    def __init__(self, shadow: Shadow, *, n_ahead: int, step_s: float) -> None:
        self._shadow, self._n_ahead, self._step_s = shadow, n_ahead, step_s
        self._waiting: deque[Intent] = deque()
        self._is_moving = False
        self._refused: Verdict | None = None

    def offer(self, intent: Intent, measured: ArmState, percept: Percept) -> tuple[Intent, Verdict | None]:
        """Return what may be sent now, and why nothing else may where the shadow was stopped."""
        if isinstance(intent, Hold):
            self._waiting.clear()
            self._is_moving, self._refused = False, None
            return intent, None
        rest = Hold(grip=intent.grip)
        if self._refused is not None:
            return rest, self._refused
        if not self._is_moving:
            self._shadow.begin(measured, percept)
            self._is_moving = True
        self._refused = self._shadow.attempt(intent, self._step_s)
        if self._refused is not None:
            self._waiting.clear()
            return rest, self._refused
        self._waiting.append(intent)
        return (self._waiting.popleft(), None) if len(self._waiting) > self._n_ahead else (rest, None)
