"""The twin fitted to sessions: read, cut, fitted on one part, judged on another. The edge to their files."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.arm import ArmConfig
from config.fitted import FittedPlant
from config.resolved import Resolved
from robot.bus.topics import ARM_STATE, SENT
from robot.messages import ArmCommand, ArmState
from robot.recording.errors import UnfitError
from robot.recording.origin import resolved_of
from robot.recording.session_file import SessionFile
from robot.recording.topics import EVENT, RESET_MARK
from sim_twin.fitted import nominal_plant
from sim_twin.fitting.estimate import Estimate, estimate, joint_errors
from sim_twin.fitting.lengths import FIELDS, Lengths, fit_lengths
from sim_twin.fitting.model import ArmAlone
from sim_twin.fitting.stream import PIECE_S, Piece, TickRow, pieces_of, rows_of
from sim_twin.fitting.values import JOINTS, VALUES, plant_of, vector_of

__all__ = ["Fit", "FitRow", "HeldOut", "Source", "fit_pieces", "fit_sessions", "read_session"]

Array = NDArray[np.float64]
GRAVITY_M_S2 = 9.81
FORCE_ACCURACY_N = 4.0
"""Of the force sensor in the flange, by the maker's data sheet."""
MOST_PIECES = 12
"""Half a minute or so: more tell little more, and take as much longer."""
HELD_EVERY = 3
SHORT_S = 1.3
"""Of the pieces of a session that has few."""


class FitRow(msgspec.Struct, frozen=True, kw_only=True):
    """One value."""

    name: str
    unit: str
    before: float
    """As the file has it."""
    value: float
    half: float | None
    """Of the 95 % interval; None where the sessions do not tell the value, which is about the file's then."""
    why: str = ""
    """Why they do not."""


class HeldOut(msgspec.Struct, frozen=True, kw_only=True):
    """How far the twin's joints are off on what was not fitted, rad, joint by joint."""

    rms_rad: tuple[float, ...]
    worst_rad: tuple[float, ...]

    @staticmethod
    def of(errors: Array) -> "HeldOut":
        """Return it of errors.  (n, 6)"""
        rms = np.sqrt((errors**2).mean(axis=0))
        return HeldOut(rms_rad=tuple(rms.tolist()), worst_rad=tuple(np.abs(errors).max(axis=0).tolist()))


class Source(msgspec.Struct, frozen=True, kw_only=True, eq=False):
    """What of a session is fitted to."""

    resolved: Resolved
    runs: list[list[TickRow]]
    about: dict[str, str]
    path: str


class Fit(msgspec.Struct, frozen=True, kw_only=True):
    """What a fit came to."""

    model: str
    serial: str
    sessions: tuple[str, ...]
    seconds: float
    """Of motion that was fitted."""
    held_out_s: float
    rows: tuple[FitRow, ...]
    lengths: tuple[FitRow, ...]
    before: HeldOut
    after: HeldOut
    noise_rad: tuple[float, ...]
    force_kg: float
    """Payload by the force on the tool alone, which a person may have set to nothing."""
    force_half_kg: float
    tool_before_m: float
    """How far the tool is off where its controller has it, by the file's lengths; and by the fitted ones."""
    tool_after_m: float
    plant: FittedPlant

    def row(self, name: str) -> FitRow:
        """Return a value's row by its name.

        Raises:
            KeyError: there is none.
        """
        found = {row.name: row for row in (*self.rows, *self.lengths)}
        return found[name]


def fit_sessions(paths: Sequence[Path]) -> tuple[Fit, Resolved, list[Piece], list[Piece]]:
    """Fit sessions of one arm.

    Returns:
        What it came to, the newest session's config, and the pieces fitted and held out.

    Raises:
        UnfitError: they are of several arms, or show too little of it.
        DamagedError: one is torn.
    """
    sources = [read_session(path) for path in paths]
    first = sources[0]
    for source in sources[1:]:
        if source.resolved.arm != first.resolved.arm or source.about.get("serial") != first.about.get("serial"):
            raise UnfitError(
                f"{source.path}: expected a session of the same arm and file as {first.path}; fit each by itself"
            )
        if source.resolved.rig.tick_s != first.resolved.rig.tick_s:
            raise UnfitError(f"{source.path}: expected ticks as long as in {first.path}; fit each by itself")
    pieces = _pieces(sources, PIECE_S)
    if len(pieces) < HELD_EVERY:
        pieces = _pieces(sources, SHORT_S)
    if len(pieces) < 2:
        raise UnfitError(
            f"{first.path}: expected two seconds or more in which the arm moves freely, there are "
            f"{sum(p.n * p.tick_s for p in pieces):.1f}; record a longer session, with nothing in the hand"
        )
    fitted, held_out = split(pieces)
    resolved = first.resolved
    fit = fit_pieces(
        resolved.arm, fitted, held_out, physics_s=min(resolved.rig.physics_s, resolved.rig.tick_s),
        serial=first.about.get("serial", ""), sessions=tuple(source.path for source in sources),
    )  # fmt: skip
    return fit, resolved, fitted, held_out


def split(pieces: Sequence[Piece]) -> tuple[list[Piece], list[Piece]]:
    """Return pieces to fit and pieces held out: every third, the last of two."""
    used = list(pieces)
    if len(used) > MOST_PIECES:
        used = [used[k] for k in np.linspace(0, len(used) - 1, MOST_PIECES).astype(int)]
    if len(used) < HELD_EVERY:
        return used[:-1], used[-1:]
    is_held = [k % HELD_EVERY == HELD_EVERY - 1 for k in range(len(used))]
    return (
        [p for p, held in zip(used, is_held, strict=True) if not held],
        [p for p, held in zip(used, is_held, strict=True) if held],
    )


def fit_pieces(
    arm: ArmConfig, fitted: Sequence[Piece], held_out: Sequence[Piece], *, physics_s: float, serial: str = "",
    sessions: tuple[str, ...] = (),
) -> Fit:  # fmt: skip
    """Fit pieces, and judge on others.

    Args:
        arm: its file, which is what it begins with.
        fitted: at least one.
        held_out: likewise.
        physics_s: a step of the twin's physics.
        serial: whose they are.
        sessions: where they are from.
    """
    opening_m = float(np.mean([p.opening_m for p in fitted]))
    alone = ArmAlone(arm, tick_s=fitted[0].tick_s, physics_s=physics_s, opening_m=opening_m)
    base = nominal_plant(arm)
    x0 = vector_of(base)
    found = estimate(alone, x0, fitted)
    lengths = fit_lengths(arm, fitted)
    plant = plant_of(found.x, base)
    if lengths is not None:
        plant = msgspec.structs.replace(plant, rows=lengths.rows)
    pull_n = np.concatenate([p.force_n for p in fitted])[:, 2]
    return Fit(
        model=arm.name, serial=serial, sessions=sessions, seconds=sum(p.n * p.tick_s for p in fitted),
        held_out_s=sum(p.n * p.tick_s for p in held_out), rows=_rows(x0, found), lengths=_length_rows(lengths),
        before=HeldOut.of(joint_errors(alone, x0, held_out)), after=HeldOut.of(joint_errors(alone, found.x, held_out)),
        noise_rad=tuple(found.noise_rad.tolist()), force_kg=-float(np.median(pull_n)) / GRAVITY_M_S2,
        force_half_kg=FORCE_ACCURACY_N / GRAVITY_M_S2, tool_before_m=0.0 if lengths is None else lengths.before_m,
        tool_after_m=0.0 if lengths is None else lengths.left_m, plant=plant,
    )  # fmt: skip


def read_session(path: Path) -> Source:
    """Read an arm's ticks out of a session.

    Raises:
        UnfitError: it has no config.
        DamagedError: it is torn.
    """
    with SessionFile(path) as session:
        resolved, about = resolved_of(session), session.about
        runs = rows_of(_told(session))
    return Source(resolved=resolved, runs=runs, about=about, path=str(path))


def _pieces(sources: Sequence[Source], piece_s: float) -> list[Piece]:
    return [
        piece
        for source in sources
        for run in source.runs
        for piece in pieces_of(run, tick_s=source.resolved.rig.tick_s, piece_s=piece_s)
    ]


def _told(session: SessionFile) -> Iterator[ArmState | ArmCommand | None]:
    """Yield measurements and commands as they were; None where the arm may have been placed anew or stopped."""
    for topic, _, message in session.messages(ARM_STATE, SENT, RESET_MARK, EVENT):
        yield None if topic in (RESET_MARK, EVENT) else message


def _rows(x0: Array, found: Estimate) -> tuple[FitRow, ...]:
    return tuple(
        FitRow(
            name=value.name, unit=value.unit, before=float(before), value=float(after),
            half=float(half) if np.isfinite(half) else None, why=why,
        )
        for value, before, after, half, why in zip(VALUES, x0, found.x, found.half, found.why, strict=True)
    )  # fmt: skip


def _length_rows(lengths: Lengths | None) -> tuple[FitRow, ...]:
    if lengths is None:
        return ()
    rows = [
        FitRow(
            name=f"{field.split('_')[0]} {joint}", unit=field.split("_")[1], before=0.0, value=float(value),
            half=float(half) if np.isfinite(half) else None,
            why="" if np.isfinite(half) else "told only together with parallel axes', or the session turns too little",
        )
        for (joint, field), value, half in zip(
            ((joint, field) for joint in JOINTS for field in FIELDS), lengths.x, lengths.half, strict=True
        )
    ]  # fmt: skip
    together = FitRow(
        name="d shoulder + elbow + wrist_1", unit="m", before=0.0, value=lengths.sum_d_m, half=lengths.sum_half_m
    )
    return (*rows, together)
