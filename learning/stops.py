"""What stopped the arm in a run, by kind, and how often in a thousand epochs. Pure."""

from collections import Counter
from collections.abc import Iterable
from typing import Self

import msgspec

from robot.messages import ArmMode

__all__ = ["Stops", "kind_of", "stops_of"]

PER_EPOCHS = 1000
_OWN_STOPS = (ArmMode.PROTECTIVE_STOP, ArmMode.SAFEGUARD_STOP, ArmMode.SAFETY_FAULT, ArmMode.EMERGENCY_STOP)
"""Stops that the arm's own controller comes to."""


class Stops(msgspec.Struct, frozen=True, kw_only=True):
    """Latches of a run's station, and over how many epochs. What a run's `stops.json` holds, its rates left out."""

    n_epochs: int = 0
    """Begun by the process that learns, test epochs too; those of evaluation workers are not among them."""
    n_by_kind: dict[str, int] = {}
    """A stop of the arm's own by its name, such as protective_stop; a refusal by its reason."""

    def __add__(self, other: Self) -> "Stops":
        n_by_kind = Counter(self.n_by_kind) + Counter(other.n_by_kind)
        return Stops(n_epochs=self.n_epochs + other.n_epochs, n_by_kind=dict(n_by_kind))

    @property
    def per_1000_epochs_by_kind(self) -> dict[str, float]:
        """How many of each kind there are in a thousand epochs; 0 where there was no epoch."""
        n = self.n_epochs
        return {kind: PER_EPOCHS * count / n if n else 0.0 for kind, count in self.n_by_kind.items()}

    @property
    def protective_per_1000_epochs(self) -> float:
        """Protective stops in a thousand epochs."""
        return self.per_1000_epochs_by_kind.get(ArmMode.PROTECTIVE_STOP.value, 0.0)

    def as_tree(self) -> dict[str, object]:
        """Return it with its rates, for a file."""
        return {
            "n_epochs": self.n_epochs,
            "n_by_kind": self.n_by_kind,
            "per_1000_epochs_by_kind": self.per_1000_epochs_by_kind,
            "protective_per_1000_epochs": self.protective_per_1000_epochs,
        }

    def line(self) -> str:
        """Return it in words."""
        rates = self.per_1000_epochs_by_kind
        kinds = "".join(f", {kind} {n} ({rates[kind]:.1f})" for kind, n in sorted(self.n_by_kind.items()))
        return (
            f"stops in {self.n_epochs} epochs (in a thousand): protective "
            f"{self.n_by_kind.get(ArmMode.PROTECTIVE_STOP.value, 0)} ({self.protective_per_1000_epochs:.1f}); "
            f"all {sum(self.n_by_kind.values())}{kinds}"
        )


def kind_of(reason: str) -> str:
    """Return the kind of a latch: the arm's own stop where its reason names one, else the word that it begins with.

    Args:
        reason: as a latched station tells it, `reason: detail`.
    """
    words = reason.replace(" ", "_").lower()
    own = next((mode.value for mode in _OWN_STOPS if mode.value in words), None)
    return own or reason.partition(":")[0]


def stops_of(reasons: Iterable[str], *, n_epochs: int) -> Stops:
    """Return the stops of a station's latches."""
    return Stops(n_epochs=n_epochs, n_by_kind=dict(Counter(map(kind_of, reasons))))
