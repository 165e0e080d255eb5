"""How a session of a run ended, and where its time went."""

import msgspec

__all__ = ["Ended"]


class Ended(msgspec.Struct, frozen=True, kw_only=True):
    """What a session came to."""

    n_done: int
    """Epochs done, those of earlier sessions counted."""
    n_epochs: int
    """Epochs asked for."""
    seconds: float
    n_decisions: int
    """Decisions while learning, in this session."""
    seconds_by_layer: dict[str, float]

    @property
    def is_finished(self) -> bool:
        """Whether all epochs are done."""
        return self.n_done >= self.n_epochs
