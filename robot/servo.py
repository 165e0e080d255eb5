"""The one law for how far an arm trails a moving servoj target. Everything that simulates this arm derives from it."""

__all__ = ["lag_s"]

GAIN_SCALE = 40.0
"""Stiffness term of the law, in servoj's gain unit."""


def lag_s(*, lookahead_s: float, gain: float, dead_time_s: float) -> float:
    """Return how many seconds the measured joints trail a ramp of servoj targets.

    The law is ours: dead_time + lookahead * (1 + 40 / gain). servoj projects the present state lookahead seconds ahead,
    so the standing lag on a ramp is about the lookahead; a soft gain adds a share to it. It is anchored on one published
    measurement, about 34 ms on a UR10e at lookahead 0.03 s, gain 1200 and 3 to 4 ms of dead time
    (Universal_Robots_Client_Library issue 86), and should be refitted from recordings of the real arm.
    """
    return dead_time_s + lookahead_s * (1.0 + GAIN_SCALE / gain)
