"""Which topics share chunks."""

from enum import StrEnum

__all__ = ["Lane"]


class Lane(StrEnum):
    """Messages that are read together lie together."""

    TICKS = "ticks"
    """Measurements, commands and verdicts of every tick."""
    DECISIONS = "decisions"
    """Percepts, decisions, what became of them: all that learning needs."""
    FRAMES = "frames"
    """Pictures of a camera."""
    VIEW = "view"
    """What viewers draw."""
