"""When what is believed of each goal last changed. A belief that doubt passed over counts as unchanged."""

from collections.abc import Sequence
from typing import Any

import msgspec

from learning.preconditions import Belief, Needs

__all__ = ["Revisions"]

HELD = 0.5
"""Needs that are more probable than all others together have taken hold; less is doubt."""


class _Revision(msgspec.Struct, frozen=True):
    """Needs, and the epoch in which they became the most probable; None where they were so from the start."""

    needs: Needs
    epoch: int | None


class Revisions:
    """For each goal its most probable needs now, and those that last took hold.

    Misses, blocks or one strange success may make other needs the most probable for a while without any of them ever
    being more probable than not. When the needs of before come back then, they never went: their epoch is theirs again.
    """

    def __init__(self, beliefs: Sequence[Belief]) -> None:
        self._newest = [_Revision(belief.most_probable, None) for belief in beliefs]
        self._held = list(self._newest)

    def grow(self, beliefs: Sequence[Belief]) -> None:
        """Take in new goals; what was believed of the others is believed still."""
        new = [_Revision(belief.most_probable, None) for belief in beliefs[len(self._newest) :]]
        self._newest, self._held = [*self._newest, *new], [*self._held, *new]

    def note(self, goal: int, belief: Belief, epoch: int) -> bool:
        """Take in what is believed after an update, and return whether the most probable needs are others now."""
        needs, held = belief.most_probable, self._held[goal]
        is_revised = needs != self._newest[goal].needs
        if is_revised:
            self._newest[goal] = held if needs == held.needs else _Revision(needs, epoch)
        if belief.confidence >= HELD:
            self._held[goal] = self._newest[goal]
        return is_revised

    def epoch(self, goal: int) -> int | None:
        """Return the epoch in which a goal's most probable needs last changed; None where they never did."""
        return self._newest[goal].epoch

    def state_dict(self) -> dict[str, Any]:
        """Return what is remembered."""
        return {"newest": [_plain(one) for one in self._newest], "held": [_plain(one) for one in self._held]}

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore bit for bit."""
        self._newest = [_revision(plain) for plain in state["newest"]]
        self._held = [_revision(plain) for plain in state["held"]]


def _plain(revision: _Revision) -> list[int | None]:
    return [*revision.needs, revision.epoch]


def _revision(plain: list[Any]) -> _Revision:
    on, off, epoch = plain
    return _Revision(Needs(on, off), epoch)
