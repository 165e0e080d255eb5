"""Lamps: the dome's middle against the table around it, two thresholds, and a state that must last to count."""

import numpy as np

from perception.calibration.lens import Array
from perception.detection.colour_file import LampModel
from perception.detection.seen import LampState

__all__ = ["Debounce", "lamp_score", "lamp_state"]

LIGHTNESS_SD, CHROMA_SD = 12.0, 4.0
"""How a dome's lightness against its surroundings, and its chroma, vary while the lamp stays as it is."""
ON_ABOVE, OFF_BELOW = 0.65, 0.35
FARTHEST_SD = 6.0
"""Of a reading from the line between off and on; farther away something else is seen."""
N_ALIKE = 3


def lamp_score(model: LampModel, reading: Array) -> float | None:
    """Return 0 for a reading as with the lamp off, 1 as with it on; none for one that is like neither.

    Fisher's direction for two classes of one spread: both differences count by how little they vary otherwise.

    Args:
        model: the lamp off and on.
        reading: lightness above the surroundings' and the two chromas.  (3,)
    """
    scale = np.array([LIGHTNESS_SD, CHROMA_SD, CHROMA_SD])
    off, on, now = np.array(model.off) / scale, np.array(model.on) / scale, reading / scale
    way = on - off
    length = float(way @ way)
    if length == 0.0 or not np.isfinite(now).all():
        return None
    score = float((now - off) @ way) / length
    aside = now - off - np.clip(score, 0.0, 1.0) * way
    return score if float(np.sqrt(aside @ aside)) <= FARTHEST_SD else None


def lamp_state(score: float | None) -> LampState:
    """Return what a score means; between the two thresholds it means nothing."""
    if score is None or OFF_BELOW < score < ON_ABOVE:
        return LampState.UNKNOWN
    return LampState.ON if score >= ON_ABOVE else LampState.OFF


class Debounce:
    """A lamp's state over pictures: it changes when as many in a row say so. Unknown ones neither count nor break."""

    def __init__(self, n_alike: int = N_ALIKE) -> None:
        self._n_alike, self._n = n_alike, 0
        self._other = LampState.UNKNOWN
        self.state = LampState.UNKNOWN

    def begin(self, state: LampState) -> LampState:
        """Believe a state from now on, and return it: where nothing was known, nothing speaks against it."""
        self.state, self._n = state, 0
        return state

    def note(self, seen: LampState) -> LampState:
        """Take one picture's state and return the one that holds."""
        if seen is LampState.UNKNOWN:
            return self.state
        if seen is self.state:
            self._n = 0
            return self.state
        self._n = self._n + 1 if seen is self._other else 1
        self._other = seen
        if self._n >= self._n_alike:
            self.state, self._n = seen, 0
        return self.state
