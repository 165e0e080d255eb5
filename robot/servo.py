"""How far the arm trails a moving servoj target."""

__all__ = ["lag_s"]


def lag_s(*, lookahead_s: float, gain: float, dead_time_s: float) -> float:
    """Return the time by which the arm trails a target that moves at constant speed.

    ``dead_time + lookahead * (1 + 40 / gain)``: the target is smoothed over the look-ahead time, and a softer
    proportional gain adds to it. UR does not publish the law; this is a model of ours, anchored on one published
    measurement (cross-correlation on a UR10e at look-ahead 0.03 s and gain 1200: about 34 ms, of which 3-4 ms are
    communication). Everything that simulates this arm takes its lag from here.
    """
    return dead_time_s + lookahead_s * (1.0 + 40.0 / gain)
