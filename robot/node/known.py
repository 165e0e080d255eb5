"""What a commander knows of a robot node's station: the newest report, and how old it is. State."""

from collections.abc import Callable

from robot.bus.station_rows import StationReport
from robot.messages import StationMode, StationState

__all__ = ["Known"]

SILENT_NS = 600_000_000
"""Reports come ten times a second: after so long without one nothing is known of the station."""


class Known:
    """Keeps the newest report of whichever robot node there is.

    Args:
        now_ns: this process's monotonic clock.
    """

    def __init__(self, *, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._report: StationReport | None = None
        self._heard_ns = 0
        self._n_latches_before = 0
        self._reasons: list[str] = []

    @property
    def report(self) -> StationReport | None:
        """The newest, None where none came yet."""
        return self._report

    @property
    def is_silent(self) -> bool:
        """Whether nothing is known of it now."""
        return self._report is None or self._now_ns() - self._heard_ns > SILENT_NS

    @property
    def n_latches(self) -> int:
        """How often it has latched; a robot node that began anew goes on counting where the last one ended."""
        return self._n_latches_before + (0 if self._report is None else self._report.n_latches)

    @property
    def latch_reasons(self) -> tuple[str, ...]:
        """Why it has latched since it is known, oldest first."""
        return tuple(self._reasons)

    def take(self, report: StationReport) -> None:
        """Take a report in, however it came; one that is older than what is known changes nothing."""
        last = self._report
        is_same = last is not None and last.begun == report.begun
        if last is not None and is_same and report.revision <= last.revision:
            return
        if last is not None and not is_same:
            self._n_latches_before += last.n_latches
        n_before = last.n_latches if last is not None and is_same else 0
        n_new = min(report.n_latches - n_before, len(report.latch_reasons))
        if last is not None and n_new > 0:
            self._reasons += report.latch_reasons[-n_new:]
        elif last is None:
            self._n_latches_before -= report.n_latches  # those of others, before this one came
        self._report, self._heard_ns = report, self._now_ns()

    def state(self, holder: int) -> StationState:
        """Return the mode as the holder of a lease sees it: what another armed is not armed for him.

        Args:
            holder: number of his lease; 0 where he has none.
        """
        report = self._report
        if report is None or self.is_silent:
            return StationState(
                mode=StationMode.DISARMED, reason=f"nothing was heard of the robot node for {SILENT_NS / 1e6:.0f} ms"
            )
        state = report.state
        is_his = holder != 0 and report.holder == holder
        if state.mode in (StationMode.LATCHED, StationMode.DISARMED) or is_his:
            return state
        reason = f"{state.source} has the lease" if report.holder else "the lease has ended"
        return StationState(mode=StationMode.DISARMED, reason=reason, source=state.source, profile=state.profile)
