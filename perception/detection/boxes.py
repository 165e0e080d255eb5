"""Boxes and their lids: the edges of a shut one and of an open one are both tried, and the better ones tell."""

import msgspec
import numpy as np

from config.scenario import Box
from perception.calibration.lens import Array
from perception.detection.eye import Eye
from perception.detection.glance import Glance
from perception.detection.outline import EdgeFit, fit_edges, fit_edges_near
from perception.detection.seen import LidSeen, LidState, Stance, ThingSeen
from perception.detection.solids import Edges, Solid, box_edges, box_solids, moved
from robot.messages import Vec3

__all__ = ["BoxFinder", "BoxFound"]

SLACK_M = 0.008
"""How far out of its region of the scenario a box is looked for."""
AROUND_PX = 6
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
        self._solids_by_state = {
            state: box_solids(box, lid_rad=None if box.lid is None else angle) for state, angle in states.items()
        }
        self._edges: dict[LidState, Edges] = {
            state: box_edges(box, lid_rad=angle, eye_m=eye.position_m - self._middle) for state, angle in states.items()
        }
        self._low, self._high = self._region()

    @property
    def name(self) -> str:
        """The box's."""
        return self._box.name

    def find(self, seen: Glance, near: Vec3 | None = None) -> BoxFound:
        """Return where the box is and how its lid is.

        Args:
            seen: the picture.
            near: where the box was seen before: it is looked for there, and elsewhere only if it is not there.
        """
        field = seen.smooth(self._low, self._high)
        if near is not None:
            at = np.array([near[0], near[1], self._table_m])
            found = self._told({s: fit_edges_near(self._eye, e, at, field) for s, e in self._edges.items()})
            if found.thing.position_m is not None:
                return found
        reach = self._reach_m
        return self._told(
            {s: fit_edges(self._eye, e, self._middle, field, reach_m=reach) for s, e in self._edges.items()}
        )

    def _told(self, fits: dict[LidState, EdgeFit | None]) -> BoxFound:
        """Return what the fits of both states tell."""
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

    def _region(self) -> tuple[Array, Array]:
        """Return the corners of all pixels that its edges can be at.  -> 2 x (2,)"""
        reach = self._reach_m
        moves = [self._middle + np.array([i * reach, j * reach, 0.0]) for i in (-1, 1) for j in (-1, 1)]
        pixels = [self._eye.pixels(edges.points_m + move) for edges in self._edges.values() for move in moves]
        around = np.concatenate(pixels)
        return np.nanmin(around, axis=0) - AROUND_PX, np.nanmax(around, axis=0) + AROUND_PX

    def _thing(self, fit: EdgeFit) -> ThingSeen:
        return ThingSeen(
            name=self._box.name, position_m=(*fit.position_m, self._table_m), stance=Stance.FIXED, axis_rad=None,
            confidence=fit.support, visible=1.0,
        )  # fmt: skip

    def _solids(self, fit: EdgeFit, state: LidState) -> tuple[Solid, ...]:
        at: Array = np.array([*fit.position_m, self._table_m])
        return tuple(moved(solid, at) for solid in self._solids_by_state[state])

    def _unseen(self) -> BoxFound:
        thing = ThingSeen(
            name=self._box.name, position_m=None, stance=Stance.UNKNOWN, axis_rad=None, confidence=0.0, visible=0.0
        )
        lid = None
        if self._box.lid is not None:
            lid = LidSeen(name=self._box.name, state=LidState.UNKNOWN, confidence=0.0)
        return BoxFound(thing=thing, lid=lid, solids=())
