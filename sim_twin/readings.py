"""What a monitor says of one limit over one course."""

import msgspec

__all__ = ["Reading"]


class Reading(msgspec.Struct, frozen=True, kw_only=True):
    """The least margin of one limit."""

    limit: str
    share: float
    """Margin as a share of the limit: 0 is at it, negative beyond."""
    value: float
    """What came, in the limit's own unit."""
    at_s: float = 0.0
    """When, from the stream's beginning."""
    detail: str = ""
    """Which joint, axis or pair."""
    is_broken: bool = False
    """Beyond the limit by more than the stated model of the plant accounts for."""
