"""What one fault came to, and whether that is what was asked."""

import msgspec

from sim_twin.broken.judge import Judged
from sim_twin.broken.proof import Proof
from sim_twin.broken.rider import Raised
from sim_twin.broken.trials import JOG_RAD, TOLD_S, Trial

__all__ = ["Outcome"]

STILL_RAD = 1e-3
"""Nothing that rests may move farther by itself."""
REST_SLACK_S = 0.03


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """What one fault came to. Times in s, angles in rad; None where it does not apply."""

    trial: Trial
    raised: Raised | None
    told_s: float | None
    """How soon after it happened that was told."""
    proof: Proof | None
    """Whether a fault that was borne was there at all."""
    stop: Judged | None
    held: str | None
    """Who held an arm whose link was lost, a while after; None where nobody did."""
    barred: str | None
    """What refused the arm while the fault lasted; None where nothing did, or nobody asked."""
    jogged_rad: float | None
    restored_rad: float | None
    """Farthest that a joint moved from the fault's end until the arm was taken again."""
    rearm_rad: float
    """Farthest that a joint moved while the arm was taken, before the first new command."""
    again: Raised | None
    """What came up when it was moved again; None where it moved."""
    begun_anew: tuple[str, ...] = ()
    """What disturbed the tries before this one."""

    def failures(self) -> tuple[str, ...]:
        """Return what is not as asked, in words."""
        wrong = list(self._wrong_stop()) if self.trial.is_stop else []
        if self.held is not None:
            wrong.append(f"still held by {self.held}")
        if self.trial.shows is not None and not (self.proof is not None and self.proof.is_so):
            wrong.append(f"not seen in effect: {None if self.proof is None else self.proof.shown}")
        if self.trial.bars and self.barred is None:
            wrong.append("the arm could be taken while the fault lasted")
        if self.barred is not None and self.trial.barred_by not in self.barred:
            wrong.append(f"expected to be refused by {self.trial.barred_by!r}")
        if self.jogged_rad is not None and not 0.9 * JOG_RAD < self.jogged_rad < 1.1 * JOG_RAD:
            wrong.append(f"the jog moved {self.jogged_rad:.3f} rad")
        if not self.rearm_rad <= STILL_RAD:
            wrong.append(f"{self.rearm_rad:.4f} rad before the first new command")
        if self.again is not None:
            wrong.append(f"did not move again: {self.again.what}")
        return tuple(wrong)

    def details(self) -> dict[str, str]:
        """Return the figures as a table shows them."""
        found: dict[str, str] = {}
        if self.raised is not None:
            found["raised"] = f"{self.raised.what}: {self.raised.detail}"
        if self.proof is not None:
            found["shown"] = self.proof.shown
        if self.stop is not None:
            found["rest_ms"] = f"{1e3 * self.stop.rest_s:.0f} of {1e3 * self.stop.predicted_s:.0f}"
            found["speed_rad_s"] = f"{self.stop.speed_rad_s:.2f}"
            found["after_rest_mrad"] = f"{1e3 * max(self.stop.after_rad, self.restored_rad or 0.0):.2f}"
        if self.jogged_rad is not None:
            found["jogged_mrad"] = f"{1e3 * self.jogged_rad:.0f}"
        if self.barred is not None:
            found["barred"] = self.barred
        found["rearm_mrad"] = f"{1e3 * self.rearm_rad:.2f}"
        found["again"] = "moves" if self.again is None else self.again.what
        if self.begun_anew:
            found["begun_anew"] = "; ".join(self.begun_anew)
        return found

    def _wrong_stop(self) -> tuple[str, ...]:
        if self.told_s is None or self.stop is None:
            return ("not told",)
        wrong: list[str] = []
        if not self.told_s <= TOLD_S:
            wrong.append(f"told after {1e3 * self.told_s:.0f} ms")
        if not self.stop.rest_s <= self.stop.predicted_s + REST_SLACK_S:
            wrong.append(f"rest after {self.stop.rest_s:.3f} s, predicted {self.stop.predicted_s:.3f} s")
        if not max(self.stop.after_rad, self.restored_rad or 0.0) <= STILL_RAD:
            wrong.append(f"moved {self.stop.after_rad:.4f} rad at rest, {self.restored_rad} rad after the fault's end")
        return tuple(wrong)
