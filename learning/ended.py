"""How a session of a run ended, and where its time went."""

import msgspec

from learning.time_spent import TimeSpent

__all__ = ["Ended"]


class Ended(msgspec.Struct, frozen=True, kw_only=True):
    """What a session came to."""

    n_done: int
    """Epochs done, those of earlier sessions counted."""
    n_epochs: int
    """Epochs asked for."""
    spent: TimeSpent
    """By this session and those before it."""

    @property
    def is_finished(self) -> bool:
        """Whether all epochs are done."""
        return self.n_done >= self.n_epochs
