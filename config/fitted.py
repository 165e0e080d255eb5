"""How one very arm differs from its kind: what `autotelic twin fit` found in sessions of it. Part of an arm's file."""

from typing import Annotated

from msgspec import Meta

from config.values import Section

__all__ = ["FittedPlant", "RowOff", "Six"]

Six = tuple[float, float, float, float, float, float]
Lag = Annotated[float, Meta(ge=0.002, le=0.5)]
Delay = Annotated[float, Meta(ge=0.0, le=0.1)]
Smoothing = Annotated[float, Meta(ge=0.0, le=0.3)]
Stiffness = Annotated[float, Meta(ge=50.0, le=200_000.0)]
Friction = Annotated[float, Meta(ge=0.0, le=200.0)]
Payload = Annotated[float, Meta(ge=-10.0, le=20.0)]
LengthOff = Annotated[float, Meta(ge=-0.5, le=0.5)]
AngleOff = Annotated[float, Meta(ge=-0.5, le=0.5)]


class RowOff(Section, frozen=True, kw_only=True):
    """What is added to one row of the Denavit-Hartenberg table."""

    a_m: LengthOff = 0.0
    d_m: LengthOff = 0.0
    alpha_rad: AngleOff = 0.0
    theta_rad: AngleOff = 0.0
    """Added to the joint's own angle."""


class FittedPlant(Section, frozen=True, kw_only=True):
    """Servos, friction, payload and lengths of one arm. Only the twin's physics reads it: motion and gate do not.

    Joints are base to wrist 3.
    """

    lag_s: tuple[Lag, Lag, Lag, Lag, Lag, Lag]
    """How long the joints trail a ramp of commands, everything in it: see robot.servo.lag_s."""
    dead_time_s: Delay
    """What of it is a delay."""
    smoothing_s: Smoothing = 0.0
    """What of it is the smoothing of commands, two equal first-order stages, before the servos."""
    stiffness_nm_rad: tuple[Stiffness, Stiffness, Stiffness, Stiffness, Stiffness, Stiffness]
    friction_nm: tuple[Friction, Friction, Friction, Friction, Friction, Friction] = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    """Dry friction; what grows with speed is in the lag."""
    payload_kg: Payload = 0.0
    """In the hand beside the tool's mass, and not compensated."""
    rows: tuple[RowOff, RowOff, RowOff, RowOff, RowOff, RowOff] = (
        RowOff(), RowOff(), RowOff(), RowOff(), RowOff(), RowOff(),
    )  # fmt: skip
