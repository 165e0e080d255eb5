"""The one table of topics. Keys are below the serial of the plant that they are about."""

import msgspec

__all__ = ["RESET", "TRUTH", "ResetRequest", "topic"]

TRUTH = "twin/truth"
"""SceneState in JSON, 100 times a second, by the process that holds the twin."""
RESET = "station/reset"
"""Query: a ResetRequest in JSON; answered when the table is laid out, by an empty reply, or by an error in words."""


class ResetRequest(msgspec.Struct, frozen=True, kw_only=True):
    """Lay the table out."""

    seed: int
    epoch: int
    digital_out: int


def topic(serial: str, name: str) -> str:
    """Return the key of a topic of one plant."""
    return f"autotelic/{serial}/{name}"
