"""What watches over an unattended run: its stops, its disk, and whom to tell. The edge."""

import shlex
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

from robot.bus.session import Bus
from robot.bus.topics import LIGHT, REPORT
from robot.errors import RobotConfigError
from robot.up.night import LEAST_FREE_BYTES, LightWatch, StopBudget

__all__ = ["NightWatch"]

ALERT_S, DISK_S = 30.0, 5.0


class NightWatch:
    """Says when a run has to end, and tells somebody.

    Args:
        folder: on the disk that is recorded to.
        alert: words of a command that gets what happened as one word more; empty tells nobody.
        say: is told what went wrong with that.

    Attributes:
        budget: The stops so far.

    Raises:
        RobotConfigError: there is no such command.
    """

    def __init__(self, folder: Path, *, alert: str = "", say: Callable[[str], object] = lambda _: None) -> None:
        self.budget, self._light = StopBudget(), LightWatch()
        self._folder, self._alert, self._say = folder, shlex.split(alert), say
        self._looked_s: float | None = None
        self._free_bytes = 0
        if self._alert and shutil.which(self._alert[0]) is None:
            raise RobotConfigError(f"--alert: expected a command that there is, came {self._alert[0]!r}")

    def listen(self, bus: Bus, now_s: Callable[[], float]) -> None:
        """Hear what the robot node tells of itself, and perception of the light, from now on."""
        bus.subscriber(LIGHT, lambda received: self._light.take(received.message))
        bus.subscriber(REPORT, lambda received: self.budget.take(received.message, now_s()))

    def why_over(self, now_s: float) -> str | None:
        """Return why the run has to end, None where it may go on."""
        if self._looked_s is None or now_s - self._looked_s >= DISK_S:
            self._looked_s, self._free_bytes = now_s, shutil.disk_usage(self._folder).free
        if self._free_bytes < LEAST_FREE_BYTES:
            return f"expected {LEAST_FREE_BYTES / 1e9:g} GB free on the disk, there are {self._free_bytes / 1e9:.2f}"
        return self._light.why_dark() or self.budget.why_spent(now_s)

    def tell(self, what: str) -> None:
        """Tell whoever is to be told; a command that fails or hangs is told of here, and ends nothing."""
        if not self._alert:
            return
        try:
            done = subprocess.run([*self._alert, what], timeout=ALERT_S, check=False, capture_output=True, text=True)
        except (OSError, subprocess.TimeoutExpired) as error:
            self._say(f"alert: {error}")
            return
        if done.returncode:
            self._say(f"alert: ended with exit code {done.returncode}: {done.stderr.strip()[-200:]}")
