"""A driver's time where the plant has none of its own: steps on an absolute grid of the wall's clock. The edge."""

from time import monotonic_ns, sleep

__all__ = ["WallPace"]


class WallPace:
    """Implements Pace for a plant in lock-step. A step that came too late is skipped, never made up for.

    Args:
        step_s: how long a step is.
    """

    def __init__(self, *, step_s: float) -> None:
        self._step_ns = round(step_s * 1e9)
        self._due_ns = monotonic_ns() + self._step_ns

    def now_ns(self) -> int:
        """Return the host's monotonic time."""
        return monotonic_ns()

    def wait_step(self) -> None:
        """Sleep until the next line of the grid."""
        left_ns = self._due_ns - monotonic_ns()
        if left_ns > 0:
            sleep(left_ns / 1e9)
            self._due_ns += self._step_ns
        else:
            self._due_ns += (1 - left_ns // self._step_ns) * self._step_ns
