"""The same intents on the lock-step twin and over the wire, and how far the tool's two paths are apart."""

from sim_twin.paired.curves import Track, compare, discrete_frechet_m, even_points
from sim_twin.paired.errands import Errand, Kind, drive_errand
from sim_twin.paired.ride import Compared, CutShortError, DisturbedError, Pair

__all__ = [
    "Compared", "CutShortError", "DisturbedError", "Errand", "Kind", "Pair", "Track", "compare", "discrete_frechet_m",
    "drive_errand", "even_points",
]  # fmt: skip
