"""What a learner, a teleoperator or a replay holds of the world."""

from typing import Protocol

from robot.messages import Intent, Percept, StationSpec, StationState, StepResult

__all__ = ["Station"]


class Station(Protocol):
    """All that learning, teleop and replay know of the world."""

    @property
    def spec(self) -> StationSpec:
        """What may be known before the first step."""
        ...

    @property
    def state(self) -> StationState:
        """Mode and reason."""
        ...

    def reset(self, *, seed: int, epoch: int) -> Percept:
        """Lay the table out for an epoch. Raises NotEngagedError if not engaged; never clears a latch."""
        ...

    def step(self, intent: Intent, *, duration_s: float | None = None) -> StepResult:
        """Carry out an intent for one time step and return the percept after it."""
        ...

    def close(self) -> None:
        """Stop and release. Idempotent."""
        ...
