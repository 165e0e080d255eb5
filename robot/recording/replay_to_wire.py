"""A session's intents once more through motion and gate of an arm on a wire, and how well the joints follow.

A wire has its own time: nothing is bit for bit, so what is told is how far joints were from where they had been at the
end of each time step. The table is laid out as it was; the arm goes to where the epoch began first, up and then over.
Only a virtual arm is taken: with hardware a replay would have to be tried on the twin first, and attended.
"""

from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path
from time import perf_counter

import msgspec

from robot.as_came import AsCame
from robot.bus.topics import ARM_STATE, PERCEPT
from robot.errors import SafetyError
from robot.local_station import LocalStation
from robot.messages import Heading, Intent, JointTarget, PlantKind, StationSpec, Vec6
from robot.node.remote_station import RemoteStation
from robot.operated import OperatedStation, operator_of
from robot.recording.errors import UnfitError
from robot.recording.messages import Asked, ResetMark
from robot.recording.replay_to_arm import fitting
from robot.recording.session_file import SessionFile
from robot.recording.topics import INTENT, RESET_MARK, STATION
from robot.rigs import find_station

__all__ = ["Epoch", "ReplayedToWire", "approach", "epochs_in", "replay_to_wire"]

APPROACH_RAD_S, NEAR_RAD, NEAR_M = 0.3, 0.02, 0.01
MOST_S = 60.0
"""How long the way to an epoch's beginning may take."""
LEASE = "replay"


class Epoch(msgspec.Struct, frozen=True, kw_only=True):
    """What was recorded of one epoch."""

    mark: ResetMark
    start_rad: Vec6
    """Where the joints were at its first percept."""
    asked: tuple[Asked, ...]
    ends_rad: tuple[Vec6, ...]
    """Where they were at the end of each time step."""


class ReplayedToWire(msgspec.Struct, frozen=True, kw_only=True):
    """What a replay over a wire came to."""

    n_epochs: int
    n_steps: int
    """Time steps that were carried out."""
    n_asked: int
    joint_error_rad: float
    """Greatest difference of a joint from where it had been at the end of a time step."""
    joint_error_p95_rad: float
    start_error_rad: float
    """The same where an epoch began, after the approach."""
    ended: str
    """Why it ended before its end; empty where it did not."""
    seconds: float

    @property
    def is_same(self) -> bool:
        """Whether all that was asked was carried out."""
        return not self.ended and self.n_steps == self.n_asked > 0

    def told(self) -> dict[str, object]:
        """Return all of it, for a script."""
        return {**msgspec.structs.asdict(self), "is_same": self.is_same}

    def lines(self) -> Iterator[str]:
        """Yield it in words."""
        yield (
            f"{self.n_epochs} epochs, {self.n_steps} of {self.n_asked} time steps in {self.seconds:.0f} s: joints at "
            f"most {1e3 * self.joint_error_rad:.1f} mrad from where they had been (95 %: "
            f"{1e3 * self.joint_error_p95_rad:.1f}), {1e3 * self.start_error_rad:.1f} mrad where epochs began"
        )
        if self.ended:
            yield f"it ended early: {self.ended}"


def replay_to_wire(path: Path, *, rig: str | None = None) -> ReplayedToWire:
    """Carry out a session's intents again on a virtual arm on a wire.

    Args:
        path: a session of that rig.
        rig: shipped rig or a file; the session's own if left out.

    Raises:
        UnfitError: the session is of another arm, serial, tool, camera, table or limits, or of no use for this; or the
            arm is real, or on no wire.
        DamagedError: it is torn.
        RobotError: the arm cannot be reached.
    """
    with SessionFile(path) as session:
        resolved = fitting(session, rig)
        if resolved.rig.bus is None or resolved.rig.expected.kind != PlantKind.VIRTUAL.value:
            raise UnfitError(
                f"{path}: expected a virtual arm on a wire, {resolved.rig.name} is a {resolved.rig.expected.kind} one: "
                "a session of lock-step goes `--to twin`, one of a real arm is not replayed to it"
            )
        marks = [mark for _, _, mark in session.messages(STATION)]
        epochs = epochs_in(session)
    if not epochs or not marks:
        raise UnfitError(f"{path}: expected a table that is laid out before the first intent, none is")
    begun_s = perf_counter()
    inner = find_station(resolved, is_driven=marks[0].is_driven)
    inner.take_lease(LEASE)
    with OperatedStation(inner, operator_of(inner, resolved.rig)) as station:
        replay = _Replay(inner, station)
        replay.run(epochs)
    return replay.came_to(epochs, perf_counter() - begun_s)


class _Replay:
    """Carries epochs out, one after another."""

    def __init__(self, inner: LocalStation | RemoteStation, station: OperatedStation) -> None:
        self._inner, self._station = inner, station
        self._errors: list[float] = []
        self._starts: list[float] = [0.0]
        self._ended = ""

    def run(self, epochs: list[Epoch]) -> None:
        for epoch in epochs:
            self._station.reset(seed=epoch.mark.seed, epoch=epoch.mark.epoch)
            try:
                for intent in approach(self._inner.measured.q_rad, epoch.start_rad, self._station.spec):
                    self._carry_out(intent, None)
                    if isinstance(intent, JointTarget) and self._is_near(epoch.start_rad):
                        break
                self._starts.append(_apart(self._inner.measured.q_rad, epoch.start_rad))
                for asked, end_rad in zip(epoch.asked, epoch.ends_rad, strict=True):
                    assert not isinstance(asked.intent, AsCame), "those are left out"
                    self._carry_out(asked.intent, asked.duration_s)
                    self._errors.append(_apart(self._inner.measured.q_rad, end_rad))
            except SafetyError as error:
                self._ended = f"epoch {epoch.mark.epoch}: {error}"
                return

    def came_to(self, epochs: list[Epoch], seconds: float) -> ReplayedToWire:
        errors = sorted(self._errors) or [0.0]
        return ReplayedToWire(
            n_epochs=len(epochs), n_steps=len(self._errors), n_asked=sum(len(e.asked) for e in epochs),
            joint_error_rad=errors[-1], joint_error_p95_rad=errors[int(0.95 * (len(errors) - 1))],
            start_error_rad=max(self._starts), ended=self._ended, seconds=seconds,
        )  # fmt: skip

    def _is_near(self, q_rad: Vec6) -> bool:
        return _apart(self._inner.measured.q_rad, q_rad) < NEAR_RAD / 4

    def _carry_out(self, intent: Intent, duration_s: float | None) -> None:
        result = self._station.step(intent, duration_s=duration_s)
        if result.verdicts:
            raise SafetyError(f"{result.verdicts[0].reason}: {result.verdicts[0].detail}")


def approach(from_rad: Vec6, to_rad: Vec6, spec: StationSpec) -> Iterator[Intent]:
    """Yield the way to where an epoch began: up to travel height, over at a slow pace, and then waiting for it.

    Whoever carries it out ends it once the arm is there; nothing is asked for where it is there already.
    """
    if _apart(from_rad, to_rad) < NEAR_RAD:
        return
    up = Heading(heading_rad=0.0, distance_m=0.0, height_m=spec.heights_m[1])
    n_up = round(2.0 / spec.step_s)
    for _ in range(n_up):
        yield up
    n_over = max(1, round(_apart(from_rad, to_rad) / (APPROACH_RAD_S * spec.step_s)))
    for k in range(1, n_over + 1):
        yield JointTarget(q_rad=_between(from_rad, to_rad, k / n_over))
    for _ in range(round(MOST_S / spec.step_s)):
        yield JointTarget(q_rad=to_rad)
    raise SafetyError(f"on its way to where the epoch began: expected the arm there within {MOST_S:.0f} s, it is not")


def epochs_in(session: SessionFile) -> list[Epoch]:
    """Return what was asked in each epoch, up to the first intent that was none, and where the joints came to."""
    found: list[_Open] = []
    stamps: list[int] = []
    joints: list[Vec6] = []
    for topic, _, message in session.messages(RESET_MARK, PERCEPT, INTENT, ARM_STATE):
        if topic is ARM_STATE:
            stamps.append(message.stamp_ns)
            joints.append(message.q_rad)
        elif topic is RESET_MARK:
            found.append(_Open(mark=message))
        elif found:
            found[-1].take(message)

    def at(stamp_ns: int) -> Vec6:
        """Return the joints measured nearest to a time: none may be older, where command was taken just then."""
        after = min(bisect_right(stamps, stamp_ns), len(stamps) - 1)
        before = max(0, after - 1)
        is_before_nearer = stamp_ns - stamps[before] <= stamps[after] - stamp_ns
        return joints[before if is_before_nearer else after]

    return [
        Epoch(
            mark=epoch.mark, start_rad=at(epoch.stamps[0]), asked=tuple(epoch.asked[: len(epoch.stamps) - 1]),
            ends_rad=tuple(at(stamp) for stamp in epoch.stamps[1 : len(epoch.asked) + 1]),
        )
        for epoch in found
        if joints and epoch.asked and len(epoch.stamps) > 1
    ]  # fmt: skip


class _Open(msgspec.Struct, kw_only=True):
    """An epoch that is being read."""

    mark: ResetMark
    asked: list[Asked] = []
    stamps: list[int] = []
    """Of its percepts."""
    is_over: bool = False

    def take(self, message: msgspec.Struct) -> None:
        """Take up an intent, or the percept after one."""
        if self.is_over:
            return
        if isinstance(message, Asked):
            self.is_over = isinstance(message.intent, AsCame)
            if not self.is_over:
                self.asked.append(message)
        elif len(self.stamps) <= len(self.asked):
            self.stamps.append(message.stamp_ns)  # pyright: ignore[reportAttributeAccessIssue] - a percept


def _apart(a: Vec6, b: Vec6) -> float:
    return max(abs(p - q) for p, q in zip(a, b, strict=True))


def _between(a: Vec6, b: Vec6, share: float) -> Vec6:
    one, two, three, four, five, six = (p + share * (q - p) for p, q in zip(a, b, strict=True))
    return one, two, three, four, five, six
