"""Ranged value types shared by the schema. Units sit in the field names."""

from typing import Annotated

import msgspec
from msgspec import Meta

__all__ = ["Angle", "Colour", "Length", "Mass", "Name", "NonNegative", "Point", "Positive", "Section", "Share", "Span"]

Name = Annotated[str, Meta(pattern=r"^[a-z][a-z0-9_]*\Z", max_length=48)]
Length = Annotated[float, Meta(ge=-3.0, le=3.0)]
Span = Annotated[float, Meta(gt=0.0, le=3.0)]
Angle = Annotated[float, Meta(ge=-6.2831853072, le=6.2831853072)]
Mass = Annotated[float, Meta(gt=0.0, le=50.0)]
Positive = Annotated[float, Meta(ge=1e-6, le=1e6)]
"""Above nothing by enough to divide by."""
NonNegative = Annotated[float, Meta(ge=0.0, le=1e6)]
Share = Annotated[float, Meta(ge=0.0, le=1.0)]
Point = tuple[Length, Length, Length]
Colour = tuple[Share, Share, Share]


class Section(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Base of every part of a config file: frozen, unknown keys refused."""
