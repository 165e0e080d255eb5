"""The one law for how far an arm trails a moving servoj target. Everything that simulates this arm derives from it."""

__all__ = ["lag_s"]

GAIN_SCALE = 40.0
"""Stiffness term of the law, in servoj's gain unit."""


def lag_s(*, lookahead_s: float, gain: float, dead_time_s: float) -> float:
    """Return how many seconds the measured joints trail a ramp of servoj targets.

    The law is a model of ours, ``dead_time + lookahead * (1 + 40 / gain)``: the target is smoothed over the look-ahead
    time, and a soft gain adds a share to it. UR does not publish it. It is anchored on one published measurement, the
    cross-correlation of sent and measured joints on a UR10e at look-ahead 0.03 s and gain 1200: about 34 ms, of which
    3 to 4 ms are communication (Universal_Robots_Client_Library issue 86). Refit it from recordings of the real arm.
    """
    return dead_time_s + lookahead_s * (1.0 + GAIN_SCALE / gain)
