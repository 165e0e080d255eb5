"""How the processes of a rig are, by what they tell of themselves. State."""

from collections.abc import Callable

import msgspec

from robot.bus.inlet import Received
from robot.bus.station_rows import Health
from robot.up.slope import MemorySlope

__all__ = ["GONE_S", "SILENT_S", "HealthBook", "Heard"]

SILENT_S = 1.5
"""Health comes twice a second: a process that was silent for so long counts as frozen, and the arm is stopped."""
GONE_S = 5.0
"""After so long it is ended and started anew."""


class Heard(msgspec.Struct, kw_only=True):
    """One process, since it was started first."""

    health: Health | None = None
    heard_s: float | None = None
    """When it was heard last; None since it was started (again) and not heard yet."""
    pid: int = 0
    """Of the process that was started; the word of another of that name is not its word. 0 where a person starts it."""
    is_leaving: bool = False
    """It said so, and is silent since."""
    is_same_clock: bool = True
    most_late_ms: float = 0.0
    most_mb: float = 0.0
    first_mb: float = 0.0
    slope: MemorySlope = msgspec.field(default_factory=MemorySlope)


class HealthBook:
    """Keeps the newest word of each process, by the name of its source.

    Args:
        names: of the processes.
        clock: the number of this process's clock.
        now_s: this process's monotonic clock.
    """

    def __init__(self, names: tuple[str, ...], *, clock: int, now_s: Callable[[], float]) -> None:
        self._clock, self._now_s = clock, now_s
        self._by_name = {name: Heard() for name in names}

    def __getitem__(self, name: str) -> Heard:
        return self._by_name[name]

    def begin(self, name: str, pid: int) -> None:
        """Note that a process was started: what was heard of it before says nothing of it."""
        heard = self._by_name[name]
        heard.heard_s, heard.pid, heard.is_leaving = None, pid, False
        heard.slope.begin(self._now_s())

    def take(self, received: Received[Health]) -> None:
        """Take a word in. Called on the bus's thread."""
        heard = self._by_name.get(received.envelope.source)
        health = received.message
        if heard is None or (heard.pid and health.pid != heard.pid):
            return
        heard.first_mb = heard.first_mb or health.rss_mb
        heard.most_late_ms = max(heard.most_late_ms, health.late_ms)
        heard.most_mb = max(heard.most_mb, health.rss_mb)
        heard.slope.note(self._now_s(), health.rss_mb)
        heard.is_same_clock = health.clock == self._clock
        heard.is_leaving = health.is_leaving
        heard.health, heard.heard_s = health, None if health.is_leaving else self._now_s()

    def age_s(self, name: str) -> float | None:
        """Return how long ago a process was heard; None where it has not been since it was started."""
        heard_s = self._by_name[name].heard_s
        return None if heard_s is None else self._now_s() - heard_s

    def is_silent(self, name: str, *, for_s: float, hub: str | None) -> bool:
        """Tell whether a process that was heard is silent; while the bus's hub is, nobody can be heard.

        Args:
            name: the process.
            for_s: how long.
            hub: name of the process that is the hub; None where it is none of these.
        """
        age_s = self.age_s(name)
        if age_s is None or age_s <= for_s:
            return False
        if hub is None or hub == name:
            return True
        hub_age_s = self.age_s(hub)
        return hub_age_s is not None and hub_age_s < SILENT_S and age_s > for_s + hub_age_s
