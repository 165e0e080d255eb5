"""The one table of topics. Keys are below the serial of the plant that they are about."""

import msgspec

__all__ = ["CELL", "RESET", "TRUTH", "CellAction", "CellTruth", "ResetRequest", "topic"]

TRUTH = "twin/truth"
"""SceneState in JSON, 100 times a second, by the process that holds the twin."""
RESET = "station/reset"
"""Query: a ResetRequest in JSON; answered when the table is laid out, by an empty reply, or by an error in words."""


CELL = "twin/cell"
"""Query: a CellAction in JSON; answered by a CellTruth, or by an error in words."""


class CellAction(msgspec.Struct, frozen=True, kw_only=True):
    """Let a finger press a button of the twin's table, or a thing lie in a box with a sensor; or let go again."""

    name: str = ""
    """Of the button or the box; empty only looks."""
    is_on: bool = False


class CellTruth(msgspec.Struct, frozen=True, kw_only=True):
    """What somebody in front of the twin's table sees."""

    lamps: dict[str, bool]
    """Lit or not, by the button's name."""
    lids: dict[str, float]
    """How far open, from 0 to 1, by the box's name."""


class ResetRequest(msgspec.Struct, frozen=True, kw_only=True):
    """Lay the table out."""

    seed: int
    epoch: int
    digital_out: int


def topic(serial: str, name: str) -> str:
    """Return the key of a topic of one plant."""
    return f"autotelic/{serial}/{name}"
