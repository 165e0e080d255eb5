"""Where a run's time went, over all its sessions. Pure."""

from typing import Self

import msgspec

__all__ = ["TimeSpent"]

MICRO = 1e6


class TimeSpent(msgspec.Struct, frozen=True, kw_only=True):
    """Seconds by layer, and for how many decisions. What a run's `profile.json` holds, its ratios left out."""

    seconds: float = 0.0
    n_decisions: int = 0
    """Decisions while learning."""
    seconds_by_layer: dict[str, float] = {}

    def __add__(self, other: Self) -> "TimeSpent":
        layers = {**self.seconds_by_layer, **other.seconds_by_layer}
        return TimeSpent(
            seconds=self.seconds + other.seconds,
            n_decisions=self.n_decisions + other.n_decisions,
            seconds_by_layer={
                name: self.seconds_by_layer.get(name, 0.0) + other.seconds_by_layer.get(name, 0.0) for name in layers
            },
        )

    @property
    def us_per_decision_by_layer(self) -> dict[str, float]:
        """Microseconds of each layer for one decision."""
        n = max(1, self.n_decisions)
        return {name: MICRO * seconds / n for name, seconds in self.seconds_by_layer.items()}

    def as_tree(self) -> dict[str, object]:
        """Return it with its ratios, for a file."""
        return {
            "seconds": self.seconds,
            "n_decisions": self.n_decisions,
            "decisions_per_s": self.n_decisions / self.seconds if self.seconds else 0.0,
            "seconds_by_layer": self.seconds_by_layer,
            "us_per_decision_by_layer": self.us_per_decision_by_layer,
        }
