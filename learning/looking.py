"""Looking again: where nothing tells whether a goal holds, the arm moves out of its own way. Pure.

What stands between the eye and a thing is mostly the hand that is at work on it. Rising clears most of it, then a step
to each side. How the eye looks at the table is not known here.
"""

import math
from collections.abc import Iterator

from robot.messages import Heading, StationSpec

__all__ = ["ways_to_look"]

RISE_STEPS, ASIDE_STEPS = 12, 3


def ways_to_look(spec: StationSpec) -> Iterator[Heading]:
    """Give the moves of one look, to be gone on with until it is seen: up, then to four sides and back."""
    travel_m = spec.heights_m[1]
    for _ in range(RISE_STEPS):
        yield Heading(heading_rad=0.0, distance_m=0.0, height_m=travel_m)
    for quarter in range(4):
        for turn in (0.0, math.pi):
            for _ in range(ASIDE_STEPS):
                yield Heading(heading_rad=quarter * math.pi / 2 + turn, distance_m=spec.max_step_m, height_m=travel_m)
