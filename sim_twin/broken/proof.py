"""Was a fault that is borne there at all? Read off the wire, beside the physics and beside how it was before. Pure."""

from collections.abc import Callable
from typing import TypeAlias

import msgspec
import numpy as np

from robot.hal.ur_primary import ArmFacts
from sim_twin.broken.witness import Seen
from sim_twin.controller.motion import SLICE_S
from sim_twin.controller.motion.wrench import GRAVITY_M_S2

__all__ = [
    "Proof",
    "Shows",
    "Sight",
    "shows_bias",
    "shows_dh",
    "shows_lag",
    "shows_late",
    "shows_noise",
    "shows_weight",
]

FEWEST, EXACT_RAD = 20, 1e-6
NOISE_SHARE, FORCE_N, DH = 0.2, 3.0, 1e-9
HONEST_LAG_S, UNDER_WAY, LATE_SHARE = 0.012, 0.1, 0.1
"""UNDER_WAY is how many of the states that are seen may have been on their way when a fault began."""


class Proof(msgspec.Struct, frozen=True, kw_only=True):
    """Whether a fault was in effect, and the figures that say so."""

    is_so: bool
    shown: str


class Sight(msgspec.Struct, frozen=True, kw_only=True):
    """What a second client was told before a fault and while it lasted."""

    before: Seen
    during: Seen
    facts: tuple[ArmFacts, ArmFacts]
    """What the arm is made of, as the primary interface told before and meanwhile."""
    rows: tuple[tuple[float, float, float, float], ...] = ()
    """What the fault says it added to the Denavit-Hartenberg rows: a and d in m, alpha and theta in rad."""


Shows: TypeAlias = Callable[[Sight], Proof]


def shows_lag(late_s: float) -> Shows:
    """States came at least so much later than the physics was there, to a slice; before, most came at once."""

    def shows(sight: Sight) -> Proof:
        before, soonest = _middle(sight.before.lag_s), _soonest(sight.during.lag_s)
        text = f"nine in ten states {1e3 * soonest:.0f} ms late or later (before: {1e3 * before:.0f} in the middle)"
        return Proof(is_so=before <= HONEST_LAG_S and soonest >= late_s - SLICE_S, shown=text)

    return shows


def shows_late(late_s: float, every: int) -> Shows:
    """One slice in so many took so much longer; before, few did."""

    def shows(sight: Sight) -> Proof:
        before, share = (_share_of(seen.period_s, late_s) for seen in (sight.before, sight.during))
        text = f"{share:.2f} of slices {1e3 * late_s:g} ms after the one before or later (before: {before:.2f})"
        return Proof(is_so=before <= share / 2 and share >= (1 - LATE_SHARE) / every, shown=text)

    return shows


def shows_noise(rad: float) -> Shows:
    """Joints are told with that spread about the physics' own; before, exactly."""

    def shows(sight: Sight) -> Proof:
        before, off = sight.before.q_off_rad, sight.during.q_off_rad
        spread = off.std(axis=0) if len(off) >= FEWEST else np.zeros(6)
        text = f"spread {_mrad(spread)} mrad about the physics' own joints (before: {_mrad(_most(before))} off)"
        is_so = abs(float(np.sqrt((spread**2).mean())) - rad) <= NOISE_SHARE * rad and bool((spread > 0.0).all())
        return Proof(is_so=_is_exact(before) and is_so, shown=text)

    return shows


def shows_bias(rad: tuple[float, ...]) -> Shows:
    """Joints are told off the physics' own by as much, all the time; before, by nothing."""

    def shows(sight: Sight) -> Proof:
        before, off = sight.before.q_off_rad, sight.during.q_off_rad
        text = f"{_mrad(np.median(off, axis=0) if len(off) else off)} mrad off the physics' own joints"
        return Proof(is_so=_is_exact(before) and _is_exact(off - np.array(rad)), shown=text)

    return shows


def shows_weight(kg: float) -> Shows:
    """The tool is pulled down by that weight more, with the payload told as before."""

    def shows(sight: Sight) -> Proof:
        told = (_middle(sight.before.payload_kg), _middle(sight.during.payload_kg))
        pulled_n = _middle(sight.before.force_n[:, 2]) - _middle(sight.during.force_n[:, 2])
        text = f"pulled down by {pulled_n:.1f} N more, payload {told[1]:.2f} kg (before: {told[0]:.2f})"
        is_so = told[0] == told[1] and abs(pulled_n - kg * GRAVITY_M_S2) <= FORCE_N
        return Proof(is_so=is_so and len(sight.during.lag_s) >= FEWEST, shown=text)

    return shows


def shows_dh(mm: float, mrad: float) -> Shows:
    """The primary interface tells the rows that the fault made, off by no more than it was asked and by something."""

    def shows(sight: Sight) -> Proof:
        before, told = (_rows(facts) for facts in sight.facts)
        off, most = told - before, 1e-3 * np.array([mm, mm, mrad, mrad])
        text = f"rows off by up to {1e3 * np.abs(off[:, :2]).max():.2f} mm, {1e3 * np.abs(off[:, 2:]).max():.2f} mrad"
        is_as_made = len(sight.rows) == len(off) and bool(np.abs(off - np.array(sight.rows)).max() <= DH)
        is_so = is_as_made and bool((np.abs(off) <= most).all()) and bool((np.abs(off).max(axis=0) > most / 10).all())
        return Proof(is_so=is_so, shown=text)

    return shows


def _rows(facts: ArmFacts) -> np.ndarray:
    return np.array([facts.a_m, facts.d_m, facts.alpha_rad, facts.theta_rad]).T


def _is_exact(off_rad: np.ndarray) -> bool:
    return len(off_rad) >= FEWEST and bool(np.quantile(np.abs(off_rad).max(axis=1), 1.0 - UNDER_WAY) <= EXACT_RAD)


def _most(off_rad: np.ndarray) -> np.ndarray:
    return np.abs(off_rad).max(axis=0) if len(off_rad) else off_rad


def _mrad(rad: np.ndarray) -> str:
    return " ".join(f"{1e3 * each:.2f}" for each in np.ravel(rad))


def _middle(values: np.ndarray) -> float:
    return float(np.median(values)) if len(values) >= FEWEST else float("nan")


def _soonest(values: np.ndarray) -> float:
    """Return what nine in ten are at least."""
    return float(np.quantile(values, UNDER_WAY)) if len(values) >= FEWEST else float("nan")


def _share_of(values: np.ndarray, least: float) -> float:
    return float((values >= least).mean()) if len(values) >= FEWEST else float("nan")
