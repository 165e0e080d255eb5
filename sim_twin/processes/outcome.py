"""What one case came to, and whether that is what was asked."""

import msgspec

from config.limits import Stopping
from robot.messages import StationMode
from sim_twin.processes.cases import Case
from sim_twin.processes.judge import RAMP_S, Ramp

__all__ = ["Outcome"]

STILL_RAD = 1e-3
"""Nothing that rests may move farther, nor come back from farther beyond its rest."""


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """What one case came to."""

    case: Case
    stopping: Stopping
    """Of the limits profile."""
    ramp: Ramp
    event_s: float
    """From the last good intent to the event; negative where intents went on after it."""
    mode: StationMode
    """Of whoever commands, after it all, before a person arms."""
    reason: str
    n_refused: int
    """Intents refused since. After that a person armed it, and it moved."""
    begun_anew: tuple[str, ...] = ()
    """What disturbed the tries before this one."""

    @property
    def rest_goal_s(self) -> float:
        """How soon after the last good intent the arm must be at rest."""
        return RAMP_S + self.stopping.time_s

    def failures(self) -> tuple[str, ...]:
        """Return what is not as asked, in words."""
        ramp, wrong = self.ramp, list[str]()
        if not ramp.ramp_s <= RAMP_S:
            wrong.append(f"the ramp began {1e3 * ramp.ramp_s:.0f} ms after the last good intent")
        if not ramp.rest_s <= self.rest_goal_s:
            wrong.append(f"rest {1e3 * ramp.rest_s:.0f} ms after the last good intent")
        if not ramp.way_m <= ramp.predicted_m:
            wrong.append(f"{1e3 * ramp.way_m:.1f} mm on, predicted {1e3 * ramp.predicted_m:.1f} mm")
        if not ramp.overshoot_rad <= STILL_RAD:
            wrong.append(f"overshot by {1e3 * ramp.overshoot_rad:.2f} mrad")
        if not ramp.after_rad <= STILL_RAD:
            wrong.append(f"moved {1e3 * ramp.after_rad:.2f} mrad at rest")
        if self.mode not in (StationMode.LATCHED, StationMode.DISARMED):
            wrong.append(f"still {self.mode}")
        if not self.n_refused:
            wrong.append("nothing was refused")
        return tuple(wrong)

    def details(self) -> dict[str, str]:
        """Return the figures as a table shows them."""
        ramp, anew = self.ramp, "; ".join(self.begun_anew)
        found = {
            "rest_ms": f"{1e3 * ramp.rest_s:.0f} of {1e3 * self.rest_goal_s:.0f}",
            "way_mm": f"{1e3 * ramp.way_m:.1f} of {1e3 * ramp.predicted_m:.1f}",
            "speed_m_s": f"{ramp.speed_m_s:.3f}",
            "overshoot_mrad": f"{1e3 * ramp.overshoot_rad:.3f}",
            "after_rest_mrad": f"{1e3 * ramp.after_rad:.3f}",
            "event_ms": f"{1e3 * self.event_s:.0f}",
            "state": f"{self.mode}: {self.reason}".rstrip(": "),
            "refused": str(self.n_refused),
        }
        return found | ({"begun_anew": anew} if anew else {})
