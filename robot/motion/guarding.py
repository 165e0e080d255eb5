"""How fast the tool itself may go low over the table. Pure.

A target sinks and slides at guarded speed there, and rises freely (target.guard). A tool that trails it would catch up
at full speed, and meet what stands there so: a cylinder that was met at 0.47 m/s felt 1.3 kN for a step of the physics.
"""

import math

from robot.messages import Vec3

__all__ = ["dragged_speed", "guarded_share", "is_guarded", "share_of_line"]

SNAP_M_S_N = 0.003
"""An arm that comes free of what held it goes on so much the faster for each newton: 50 N gave a tool 0.07 m/s more."""
LEAST_SHARE = 0.1
"""Of its speed, so much is left to a tool that is held ever so hard: it must get away."""


def is_guarded(at_m: Vec3, to_m: Vec3, guard_z_m: float) -> bool:
    """Return whether a way is low over the table, or leads there, and does not just rise.

    Args:
        at_m: where it begins.
        to_m: where it ends.
        guard_z_m: what is lower is low.
    """
    return min(at_m[2], to_m[2]) < guard_z_m and not (to_m[2] >= at_m[2] and to_m[0] == at_m[0] and to_m[1] == at_m[1])


def guarded_share(at_m: Vec3, to_m: Vec3, speed_m_s: float, guarded_m_s: float) -> float:
    """Return the share of the axes' greatest speed at which a tool sinks and slides as guarded, the two together.

    Its axes arrive together: along the line the longest of them goes at the greatest speed.

    Args:
        at_m: where it is.
        to_m: where it goes.
        speed_m_s: the axes' greatest speed.
        guarded_m_s: how fast it may sink and slide.
    """
    dx, dy, dz = to_m[0] - at_m[0], to_m[1] - at_m[1], to_m[2] - at_m[2]
    longest = max(abs(dx), abs(dy), abs(dz))
    fastest = speed_m_s * math.hypot(dx, dy, min(0.0, dz)) / longest if longest > 0.0 else 0.0
    return min(1.0, guarded_m_s / fastest) if fastest > 0.0 else 1.0


def share_of_line(at_m: Vec3, to_m: Vec3, speed_m_s: float, most_m_s: float) -> float:
    """Return the share of the axes' greatest speed at which a tool that goes straight is no faster than it may be.

    Args:
        at_m: where it is.
        to_m: where it goes.
        speed_m_s: the axes' greatest speed.
        most_m_s: how fast it may go along its line.
    """
    longest = max(abs(to_m[0] - at_m[0]), abs(to_m[1] - at_m[1]), abs(to_m[2] - at_m[2]))
    fastest = speed_m_s * math.dist(at_m, to_m) / longest if longest > 0.0 else 0.0
    return min(1.0, most_m_s / fastest) if fastest > 0.0 else 1.0


def dragged_speed(force_n: Vec3, contact_force_n: float, most_m_s: float) -> float:
    """Return how fast a tool may go that something holds: let go of all at once it must be no faster than it may.

    A finger that hung on a box's rim was dragged up at full speed, the arm bent by 5 mm: off the rim the tool went
    0.32 m/s where 0.25 are allowed.

    Args:
        force_n: force of the world on the tool.
        contact_force_n: what is no more than this holds nothing.
        most_m_s: how fast it may go at all.
    """
    held_n = max(0.0, math.hypot(*force_n) - contact_force_n)
    return max(LEAST_SHARE * most_m_s, most_m_s - SNAP_M_S_N * held_n)
