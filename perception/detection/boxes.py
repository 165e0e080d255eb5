"""Boxes and their lids: the edges of a shut one and of an open one are both tried, and the better ones tell."""

import msgspec
import numpy as np

from config.scenario import Box
from perception.calibration.lens import Array
from perception.detection.eye import Eye
from perception.detection.outline import EdgeFit, Slopes, fit_edges
from perception.detection.seen import LidSeen, LidState, Stance, ThingSeen
from perception.detection.solids import Edges, Solid, box_edges, box_solids, moved

__all__ = ["BoxFinder", "BoxFound"]

SLACK_M = 0.008
"""How far out of its region of the scenario a box is looked for."""
LEAST_SUPPORT = 0.5
LEAST_MARGIN = 0.06
"""By so much the edges of one state must fit better than those of the other."""


class BoxFound(msgspec.Struct, frozen=True, kw_only=True):
    """What was found of a box."""

    thing: ThingSeen
    lid: LidSeen | None
    solids: tuple[Solid, ...]
    """Its walls and leaves where they are seen to be, base frame; walls alone where the lid is unknown."""


class BoxFinder:
    """Finds one box of a scenario through one camera."""

    def __init__(self, box: Box, table_m: float, eye: Eye) -> None:
        self._box, self._eye, self._table_m = box, eye, table_m
        self._middle = np.array([*box.position_m, table_m])
        self._reach_m = max(box.spread_m) + SLACK_M
        states = {LidState.SHUT: 0.0} if box.lid is None else {
            LidState.SHUT: 0.0, LidState.OPEN: box.lid.open_angle_rad
        }  # fmt: skip
        self._angles = states
        self._edges: dict[LidState, Edges] = {
            state: box_edges(box, lid_rad=angle, eye_m=eye.position_m - self._middle) for state, angle in states.items()
        }

    def find(self, slopes: Slopes) -> BoxFound:
        """Return where the box is and how its lid is."""
        fits = {s: fit_edges(self._eye, e, self._middle, slopes, reach_m=self._reach_m) for s, e in self._edges.items()}
        found = {s: fit for s, fit in fits.items() if fit is not None}
        if not found:
            return self._unseen()
        state = max(found, key=lambda s: found[s].support)
        best = found[state]
        others = [fit.support for s, fit in found.items() if s is not state]
        margin = best.support - max(others, default=0.0)
        is_placed = best.support >= LEAST_SUPPORT
        is_told = is_placed and (margin >= LEAST_MARGIN or len(self._edges) == 1)
        lid = None if self._box.lid is None else LidSeen(
            name=self._box.name, state=state if is_told else LidState.UNKNOWN,
            confidence=float(np.clip(margin / (2.0 * LEAST_MARGIN), 0.0, 1.0)) if is_placed else 0.0,
        )  # fmt: skip
        if not is_told:
            return msgspec.structs.replace(self._unseen(), lid=lid)
        return BoxFound(thing=self._thing(best), lid=lid, solids=self._solids(best, state))

    def _thing(self, fit: EdgeFit) -> ThingSeen:
        return ThingSeen(
            name=self._box.name, position_m=(*fit.position_m, self._table_m), stance=Stance.FIXED, axis_rad=None,
            confidence=fit.support, visible=1.0,
        )  # fmt: skip

    def _solids(self, fit: EdgeFit, state: LidState) -> tuple[Solid, ...]:
        at: Array = np.array([*fit.position_m, self._table_m])
        angle = None if self._box.lid is None else self._angles[state]
        return tuple(moved(solid, at) for solid in box_solids(self._box, lid_rad=angle))

    def _unseen(self) -> BoxFound:
        thing = ThingSeen(
            name=self._box.name, position_m=None, stance=Stance.UNKNOWN, axis_rad=None, confidence=0.0, visible=0.0
        )
        lid = None
        if self._box.lid is not None:
            lid = LidSeen(name=self._box.name, state=LidState.UNKNOWN, confidence=0.0)
        return BoxFound(thing=thing, lid=lid, solids=())
