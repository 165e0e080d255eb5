"""How fast the tool itself may go low over the table. Pure.

A target sinks and slides at guarded speed there, and rises freely (target.guard). A tool that trails it would catch up
at full speed, and meet what stands there so: a cylinder that was met at 0.47 m/s felt 1.3 kN for a step of the physics.
"""

import math

from robot.messages import Vec3

__all__ = ["guarded_share", "is_guarded"]


def is_guarded(at_m: Vec3, to_m: Vec3, guard_z_m: float) -> bool:
    """Return whether a way is low over the table, or leads there, and does not just rise.

    Args:
        at_m: where it begins.
        to_m: where it ends.
        guard_z_m: what is lower is low.
    """
    return min(at_m[2], to_m[2]) < guard_z_m and not (to_m[2] >= at_m[2] and to_m[0] == at_m[0] and to_m[1] == at_m[1])


def guarded_share(at_m: Vec3, to_m: Vec3, speed_m_s: float, guarded_m_s: float) -> float:
    """Return the share of the axes' greatest speed at which a tool that goes straight sinks and slides as guarded.

    Its axes arrive together: along the line the longest of them goes at the greatest speed.

    Args:
        at_m: where it is.
        to_m: where it goes.
        speed_m_s: the axes' greatest speed.
        guarded_m_s: how fast it may sink, and slide.
    """
    dx, dy, dz = to_m[0] - at_m[0], to_m[1] - at_m[1], to_m[2] - at_m[2]
    longest = max(abs(dx), abs(dy), abs(dz))
    fastest = speed_m_s * max(math.hypot(dx, dy), -dz) / longest if longest > 0.0 else 0.0
    return min(1.0, guarded_m_s / fastest) if fastest > 0.0 else 1.0
