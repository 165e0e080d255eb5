"""A session's intents once more through motion and gate of the twin that recorded them, and how well joints follow.

In lock-step the same intents on the same table make the same joints, to the last bit; what differs is told. An arm on a
wire has its own time: robot.recording.replay_to_wire.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator
from pathlib import Path
from time import perf_counter

import msgspec

from config.loader import with_rig
from config.resolved import Resolved
from robot.as_came import AsCame
from robot.bus.topics import ARM_STATE, PERCEPT
from robot.messages import ArmCommand, ArmState, Vec6, Verdict
from robot.operated import OperatedStation
from robot.recording.errors import UnfitError
from robot.recording.messages import Asked, ResetMark
from robot.recording.origin import resolved_of
from robot.recording.session_file import SessionFile
from robot.recording.topics import INTENT, RESET_MARK, STATION
from robot.rigs import build_operator, build_station

__all__ = ["EXACT_RAD", "ReplayedToArm", "fitting", "replay_to_arm"]

EXACT_RAD = 1e-9
SAME = ("arm", "scenario", "rule_sets", "limits", "cell")
"""What must be as it was."""


class ReplayedToArm(msgspec.Struct, frozen=True, kw_only=True):
    """What a replay of commands came to."""

    n_epochs: int
    n_steps: int
    n_ticks: int
    """Measurements that were compared."""
    joint_error_rad: float
    """Greatest difference of a joint from where it was recorded."""
    n_missing: int
    """Measurements of the one that the other lacks."""
    recorded_s: float
    seconds: float

    @property
    def is_same(self) -> bool:
        """Whether joints went as they had."""
        return self.n_ticks > 0 and not self.n_missing and self.joint_error_rad <= EXACT_RAD

    def told(self) -> dict[str, object]:
        """Return all of it, for a script."""
        return {**msgspec.structs.asdict(self), "is_same": self.is_same}

    def lines(self) -> Iterator[str]:
        """Yield it in words."""
        yield (
            f"{self.n_epochs} epochs, {self.n_steps} time steps, {self.n_ticks} measurements: joints at most "
            f"{self.joint_error_rad:.3g} rad from where they were"
        )
        if self.n_missing:
            yield f"{self.n_missing} measurements are in one of the two only"


Ticks = dict[int, Vec6]
"""Joints by the time since an epoch's first percept."""


class _Heard:
    """Implements robot.tick_tap.TickTap: keeps measured joints."""

    def __init__(self) -> None:
        self.kept: list[tuple[int, Vec6]] = []

    def measured(self, state: ArmState) -> None:
        if not self.kept or self.kept[-1][0] != state.stamp_ns:
            self.kept.append((state.stamp_ns, state.q_rad))

    def commanded(self, command: ArmCommand, limiters: tuple[str, ...], verdict: Verdict | None) -> None:
        """Nothing is asked of commands."""

    def refused(self, verdict: Verdict) -> None:
        """Nothing is asked of refusals."""


class _Epoch(msgspec.Struct, kw_only=True):
    """What was recorded of one epoch."""

    mark: ResetMark
    begun_ns: int | None = None
    """Stamp of its first percept."""
    ended_ns: int = 0
    """Of its last."""
    asked: list[Asked] = []
    ticks: Ticks = {}


def replay_to_arm(path: Path, *, rig: str | None = None) -> ReplayedToArm:
    """Carry out a session's intents again and compare the joints, tick by tick.

    Args:
        path: a session of a rig in lock-step.
        rig: shipped rig or a file; the session's own if left out.

    Raises:
        UnfitError: the session is of another arm, tool, serial, table or limits than the rig, or of no use for this.
        DamagedError: it is torn.
    """
    with SessionFile(path) as session:
        resolved = fitting(session, rig)
        if resolved.rig.bus is not None:
            raise UnfitError(
                f"{session.path}: expected a rig in lock-step, {resolved.rig.name} is on a wire: `--to arm`; nothing "
                "moves"
            )
        marks = [mark for _, _, mark in session.messages(STATION)]
        if not marks:
            raise UnfitError(f"{path}: expected what its station was, there is nothing")
        epochs = _epochs_of(session)
    if not epochs:
        raise UnfitError(f"{path}: expected a table that is laid out before the first intent, none is")
    heard = _Heard()
    inner = build_station(resolved, is_driven=marks[0].is_driven, tap=heard)
    begun_s = perf_counter()
    with OperatedStation(inner, build_operator(resolved.rig)) as station:
        done = [_replayed(station, epoch, heard) for epoch in epochs]
    seconds = perf_counter() - begun_s
    errors, n_missing, n_ticks = _compared(epochs, done)
    return ReplayedToArm(
        n_epochs=len(epochs), n_steps=sum(len(e.asked) for e in epochs), n_ticks=n_ticks, joint_error_rad=errors,
        n_missing=n_missing, recorded_s=sum(max(e.ticks, default=0) for e in epochs) / 1e9, seconds=seconds,
    )  # fmt: skip


def fitting(session: SessionFile, rig: str | None) -> Resolved:
    """Return what to replay a session on, held to what it was recorded on.

    Raises:
        UnfitError: it is not what the session was recorded on.
    """
    then = resolved_of(session)
    now = then if rig is None else with_rig(then, rig)
    expected, got = then.rig.expected, now.rig.expected
    if (expected.kind, expected.model, expected.serial) != (got.kind, got.model, got.serial):
        raise UnfitError(
            f"{session.path}: expected the {expected.kind} {expected.model} {expected.serial} that recorded it, got "
            f"{got.kind} {got.model} {got.serial or 'without a serial'}"
        )
    changed = [name for name in SAME if getattr(then, name) != getattr(now, name)]
    if changed:
        raise UnfitError(f"{session.path}: expected the same {' and '.join(changed)} as when it was recorded")
    if then.rig.camera != now.rig.camera:
        raise UnfitError(f"{session.path}: expected the same camera and calibration as when it was recorded")
    return now


def _epochs_of(session: SessionFile) -> list[_Epoch]:
    epochs: list[_Epoch] = []
    ticks: list[tuple[int, Vec6]] = []
    for topic, _, message in session.messages(RESET_MARK, PERCEPT, INTENT, ARM_STATE):
        if topic is ARM_STATE:
            ticks.append((message.stamp_ns, message.q_rad))
        elif topic is RESET_MARK:
            epochs.append(_Epoch(mark=message))
        elif not epochs:
            continue
        elif topic is PERCEPT:
            epoch = epochs[-1]
            epoch.begun_ns = message.stamp_ns if epoch.begun_ns is None else epoch.begun_ns
            epoch.ended_ns = message.stamp_ns
        else:
            epochs[-1].asked.append(message)
    stamps = [stamp for stamp, _ in ticks]
    for epoch in epochs:
        first = bisect_left(stamps, epoch.begun_ns or 0)
        epoch.ticks = _since(ticks[first : bisect_right(stamps, epoch.ended_ns)], epoch.begun_ns)
    return epochs


def _replayed(station: OperatedStation, epoch: _Epoch, heard: _Heard) -> Ticks:
    begun_ns = station.reset(seed=epoch.mark.seed, epoch=epoch.mark.epoch).stamp_ns
    heard.kept = heard.kept[-1:]
    for asked in epoch.asked:
        if isinstance(asked.intent, AsCame):
            break  # it was none, and latched
        if station.step(asked.intent, duration_s=asked.duration_s).is_void:
            break
    return _since(heard.kept, begun_ns)


def _since(ticks: Iterable[tuple[int, Vec6]], begun_ns: int | None) -> Ticks:
    """Return joints by the time since an epoch's first percept; what was before it is left out."""
    if begun_ns is None:
        return {}
    return {stamp - begun_ns: q for stamp, q in ticks if stamp >= begun_ns}


def _compared(epochs: list[_Epoch], done: list[Ticks]) -> tuple[float, int, int]:
    """Return the greatest difference, how many measurements only one has, and how many were compared."""
    worst, n_missing, n_ticks = 0.0, 0, 0
    for epoch, now in zip(epochs, done, strict=True):
        then = epoch.ticks
        n_missing += len(then.keys() ^ now.keys())
        for at in then.keys() & now.keys():
            n_ticks += 1
            worst = max(worst, max(abs(a - b) for a, b in zip(then[at], now[at], strict=True)))
    return worst, n_missing, n_ticks
