"""What the arm measures after each slice."""

import msgspec

from sim_twin.controller.motion.poses import Array

__all__ = ["Measured"]


class Measured(msgspec.Struct, frozen=True, kw_only=True):
    """What the arm measured after a slice. Arrays of their own; base axes, SI units."""

    q_rad: Array
    qd_rad_s: Array
    tcp_pose: Array
    """UR pose of the tool that the program set."""
    tcp_speed: Array
    """(v, w) of it."""
    acceleration: Array
    """Of the flange, without gravity; an accelerometer's, which no encoder's noise touches."""
    wrench: Array
    """Force and torque of the world on the tool, at the tool; payload as told taken off, zeroed."""
    torque_nm: Array
    """Of the joints, weight included."""
    current_a: Array
    """Torque over a constant of each joint."""
    external_nm: Array
    """Torque on the joints from contacts."""
