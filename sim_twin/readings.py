"""What a monitor says of one limit over one course."""

import msgspec
import numpy as np
from numpy.typing import NDArray

__all__ = ["Margin", "Reading"]

Array = NDArray[np.float64]


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


class Margin(msgspec.Struct, frozen=True):
    """The margin of one limit at every instant of a course."""

    limit: str
    share: Array
    """(n,) or (n, k): of k joints, axes or parts"""
    value: Array
    """As share, in the limit's own unit."""
    dt_s: float
    """Between two instants."""

    @property
    def least(self) -> Array:
        """The least share at each instant.  () -> (n,)"""
        return self.share.reshape(len(self.share), -1).min(axis=1)

    def worst(self) -> Reading:
        """Return the least of all, the value there, when that was and of which column."""
        k = int(np.argmin(self.share))
        columns = self.share.size // len(self.share)
        return Reading(
            limit=self.limit,
            share=float(self.share.flat[k]),
            value=float(self.value.flat[k]),
            at_s=k // columns * self.dt_s,
            detail=f"#{k % columns + 1}" if columns > 1 else "",
        )
