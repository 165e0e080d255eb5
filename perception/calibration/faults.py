"""Why a set of views or touches is refused, each with what came and what to do. Plain values and pure sums."""

from enum import StrEnum

import msgspec

from perception.errors import CalibrationRefusedError

__all__ = ["Fault", "Reason", "refuse"]


class Reason(StrEnum):
    """What can be wrong with what was gathered."""

    TOO_FEW = "too few"
    BLURRED = "blurred"
    ALIKE = "alike"
    PLANAR = "planar only"
    COVERAGE = "coverage"
    SIZES = "picture sizes"
    SQUARE_SIZE = "square size"
    RESIDUAL = "residual"
    UNCERTAIN = "uncertain"
    TOUCHES = "touches"
    MOTION = "too little turned"
    IN_THE_FIT = "in the fit"


class Fault(msgspec.Struct, frozen=True, kw_only=True):
    """One thing that is wrong."""

    reason: Reason
    detail: str
    """What was expected, what came, what to try."""


def refuse(faults: list[Fault]) -> None:
    """Raise what is wrong, all of it at once, if anything is.

    Raises:
        CalibrationRefusedError: something is.
    """
    if faults:
        lines = "".join(f"\n  {fault.reason}: {fault.detail}" for fault in faults)
        raise CalibrationRefusedError(f"refused, nothing was written{lines}")
