"""The dataset doctor: what is wrong with a session, stream by stream. Pure but for reading the file.

Errors make a session unfit to learn from or to replay; warnings are worth a look.
"""

import itertools
from bisect import bisect_right
from collections.abc import Iterator
from enum import StrEnum

import msgspec

from robot.bus.topics import ARM_STATE, CAMERA_IMAGE, HEALTH, PERCEPT, REQUESTED, SENT, STOP, VERDICT
from robot.recording.errors import DamagedError
from robot.recording.messages import Purpose
from robot.recording.recording import CONFIG, MODEL, STOPPED, VERSIONS
from robot.recording.session_file import Raw, SessionFile
from robot.recording.topics import EPOCH, EVENT, GOAL, INTENT, RECORDED, RESET_MARK, STATION, STEP

__all__ = ["Checked", "Finding", "Severity", "Stream", "check", "lines"]

PAUSE_NS = 500_000_000
Excused = tuple[list[tuple[int, int]], list[tuple[int, int]]]
"""Spans that a gap may touch, and those that it may lie in."""
GAP = 3.0
"""Times the usual distance between two messages."""
LATE_NS = 20_000_000
"""Ticks of 2 ms that came no later than this were late, and nothing was lost."""
BEFORE_NS = 1_000_000_000
"""So long an arm on a wire may go on ticking after somebody began to lay its table out."""
FROZEN_N = 50
"""So many measurements in a row that are the same to the last bit: no sensor is that quiet while something moves."""
N_SAME_FRAMES = 5
"""So many pictures in a row that are the same to the last bit: no sensor is without noise."""
MOVING_RAD = 1e-3
OFTEN = 0.5
"""Share of steps that a limiter has a hand in, from which actions count as clipped."""
NEEDED = (CONFIG, MODEL, VERSIONS)
STEADY = (ARM_STATE.name, REQUESTED.name, SENT.name, VERDICT.name, PERCEPT.name, CAMERA_IMAGE.name)
"""Streams that should come at a rate while the arm is driven."""
OF_MANY = (HEALTH.name, STOP.name)
"""Written by every process: stamps of one say nothing of another's."""
EXCUSES = (RESET_MARK.name, EVENT.name)
"""What excuses a gap, or a percept that is the one before: a table that is laid out, a step that was cut short."""
DRIFT = 1e-3
MOST_PER_KIND = 20


class Severity(StrEnum):
    """How bad it is."""

    ERROR = "error"
    WARNING = "warning"


class Finding(msgspec.Struct, frozen=True, kw_only=True):
    """One thing that is not as it should be."""

    kind: str
    severity: Severity
    topic: str
    at_s: float | None
    detail: str


class Stream(msgspec.Struct, frozen=True, kw_only=True):
    """What one topic holds."""

    topic: str
    n: int
    first_s: float
    last_s: float
    usual_s: float | None
    """Median distance between two messages."""


class Checked(msgspec.Struct, frozen=True, kw_only=True):
    """What a check came to."""

    path: str
    streams: tuple[Stream, ...]
    findings: tuple[Finding, ...]
    n_left_out: int
    """Findings of a kind beyond the first twenty."""

    @property
    def is_sound(self) -> bool:
        """Whether nothing is an error."""
        return all(finding.severity is not Severity.ERROR for finding in self.findings)


class _Findings:
    """Keeps the first few of each kind and topic."""

    def __init__(self) -> None:
        self.kept: list[Finding] = []
        self._n: dict[tuple[str, str], int] = {}
        self.n_left_out = 0

    def add(
        self, kind: str, topic: str, detail: str, *, at_ns: int | None = None, severity: Severity = Severity.ERROR
    ) -> None:
        key = (kind, topic)
        self._n[key] = self._n.get(key, 0) + 1
        if self._n[key] > MOST_PER_KIND:
            self.n_left_out += 1
            return
        at_s = None if at_ns is None else at_ns / 1e9
        self.kept.append(Finding(kind=kind, severity=severity, topic=topic, at_s=at_s, detail=detail))


def check(session: SessionFile) -> Checked:
    """Look through a whole session."""
    found = _Findings()
    _look_at_parts(session, found)
    streams: list[Stream] = []
    try:
        by_topic: dict[str, list[Raw]] = {}
        for raw in session.raw():
            by_topic.setdefault(session.topic_of(raw.channel), []).append(raw)
        lasts_ns = BEFORE_NS if session.about.get("clock") == "host" else 0
        excused = [(raw.log_ns, raw.log_ns + lasts_ns) for topic in EXCUSES for raw in by_topic.get(topic, [])]
        pauses = _pauses(by_topic.get(STEP.name, []), by_topic.get(INTENT.name, [])) if lasts_ns else []
        for topic, raws in sorted(by_topic.items()):
            streams.append(_stream(topic, raws))
            _look_at_times(topic, raws, (excused, pauses), found)
        if STOPPED not in session.about:  # a stop's file begins and ends within an epoch
            _look_at_epochs(session, found)
        _look_at_events(session, found)
        _look_at_joints(session, found)
        _look_at_frames(session, found)
        _look_at_limiters(session, found)
    except DamagedError as error:
        found.add("damaged", "", str(error))
    return Checked(
        path=str(session.path), streams=tuple(streams), findings=tuple(found.kept), n_left_out=found.n_left_out
    )


def _look_at_parts(session: SessionFile, found: _Findings) -> None:
    """Attachments, metadata and schemas."""
    names = {attached.name for attached in session.attachments()}
    for name in NEEDED:
        if name not in names:
            found.add("missing attachment", "", f"expected {name}, there is none")
    if not session.about:
        found.add("missing metadata", "", "expected metadata of the name session, there are none")
    known = {topic.name: topic for topic in RECORDED}
    for number, channel in session.channels.items():
        topic = known.get(channel.topic)
        if topic is not None and session.is_drifted(number, topic):
            detail = "recorded with another version's type: what is new has its default"
            found.add("schema drift", channel.topic, detail, severity=Severity.WARNING)
    statistics = session.statistics
    if statistics is None:
        found.add("missing statistics", "", "expected statistics, there are none", severity=Severity.WARNING)


def _stream(topic: str, raws: list[Raw]) -> Stream:
    gaps = sorted(b.log_ns - a.log_ns for a, b in itertools.pairwise(raws))
    usual = gaps[len(gaps) // 2] / 1e9 if gaps else None
    return Stream(topic=topic, n=len(raws), first_s=raws[0].log_ns / 1e9, last_s=raws[-1].log_ns / 1e9, usual_s=usual)


def _look_at_times(topic: str, raws: list[Raw], excused: Excused, found: _Findings) -> None:
    """Stamps that go back, come twice, drift or are missing; messages lost on their way into the file."""
    sequence: dict[int, int] = {}
    for raw in raws:
        expected = sequence.get(raw.channel, 0)
        if raw.sequence > expected:
            detail = f"messages {expected} to {raw.sequence - 1} are missing"
            found.add("lost messages", topic, detail, at_ns=raw.log_ns)
        sequence[raw.channel] = raw.sequence + 1
    for a, b in itertools.pairwise(raws):
        if b.publish_ns < a.publish_ns and topic not in OF_MANY:
            detail = f"a stamp of {b.publish_ns / 1e9:.6f} s after one of {a.publish_ns / 1e9:.6f} s"
            found.add("stamps go back", topic, detail, at_ns=b.log_ns)
    if topic in STEADY:
        _look_at_rate(topic, raws, excused, found)


def _is_excused(begin_ns: int, end_ns: int, excused: Excused) -> bool:
    touched, around = excused
    return any(begin <= end_ns and begin_ns <= end for begin, end in touched) or any(
        begin <= begin_ns + LATE_NS and end_ns <= end + LATE_NS for begin, end in around
    )


def _pauses(steps: list[Raw], intents: list[Raw]) -> list[tuple[int, int]]:
    """Return the spans in which nobody asked anything of an arm on a wire: while it is armed again it does not tick."""
    asked_ns = [raw.log_ns for raw in intents]
    found: list[tuple[int, int]] = []
    for raw in steps:
        n = bisect_right(asked_ns, raw.log_ns)
        until_ns = asked_ns[n] if n < len(asked_ns) else raw.log_ns
        if until_ns - raw.log_ns > PAUSE_NS:
            found.append((raw.log_ns, until_ns))
    return found


def _look_at_rate(topic: str, raws: list[Raw], excused: Excused, found: _Findings) -> None:
    """Gaps, duplicates and drift of a stream that should be steady; resets and stops take their own time, or none."""
    distances = sorted(b.publish_ns - a.publish_ns for a, b in itertools.pairwise(raws))
    usual = distances[len(distances) // 2] if distances else 0
    for a, b in itertools.pairwise(raws):
        far = b.publish_ns - a.publish_ns
        is_odd = far == 0 or far > GAP * usual
        if is_odd and _is_excused(a.log_ns, b.log_ns, excused):
            continue
        if far == 0 and a.payload == b.payload:
            found.add("duplicate", topic, f"the message of {a.publish_ns / 1e9:.6f} s came twice", at_ns=b.log_ns)
        elif usual and far > GAP * usual:
            is_late = far <= LATE_NS
            kind, severity = ("late", Severity.WARNING) if is_late else ("gap", Severity.ERROR)
            detail = f"{far / 1e9:.3f} s, usually {usual / 1e9:.3f} s"
            found.add(kind, topic, detail, at_ns=a.log_ns, severity=severity)
    if len(raws) > FROZEN_N:
        first, last = raws[0], raws[-1]
        log, own = last.log_ns - first.log_ns, last.publish_ns - first.publish_ns
        if own and abs(log - own) > DRIFT * own:
            detail = f"its own stamps cover {own / 1e9:.3f} s of {log / 1e9:.3f} s of the session"
            found.add("drift", topic, detail, severity=Severity.WARNING)


def _look_at_epochs(session: SessionFile, found: _Findings) -> None:
    """Epochs without an outcome, and outcomes without an epoch."""
    about = session.about
    chosen: dict[int, int] = {}
    for topic, raw, message in session.messages(GOAL, EPOCH):
        if topic is GOAL:
            chosen[message.epoch] = raw.log_ns
        elif message.epoch in chosen:
            del chosen[message.epoch]
        else:
            found.add("outcome of no epoch", EPOCH.name, f"epoch {message.epoch} was never begun", at_ns=raw.log_ns)
    for epoch, at_ns in chosen.items():
        found.add("no outcome", EPOCH.name, f"epoch {epoch} was begun and has no outcome", at_ns=at_ns)
    if about.get("purpose") == Purpose.LEARN.value and not any(True for _ in session.messages(STATION)):
        found.add("no station", STATION.name, "expected what the station is, there is nothing")


def _look_at_events(session: SessionFile, found: _Findings) -> None:
    """What was noted while it was recorded."""
    for _, raw, event in session.messages(EVENT):
        found.add("event", EVENT.name, f"{event.what}: {event.detail}", at_ns=raw.log_ns, severity=Severity.WARNING)


def _look_at_joints(session: SessionFile, found: _Findings) -> None:
    """Measured joints that stand still to the last bit while they are told to move."""
    n_same, begun_ns, before, asked, asked_then = 0, 0, None, None, None
    for topic, raw, message in session.messages(ARM_STATE, SENT):
        if topic is SENT:
            asked = message.q_rad
            continue
        if before is not None and message.q_rad == before.q_rad and message.tcp_force_n == before.tcp_force_n:
            n_same += 1
        else:
            n_same, begun_ns, asked_then = 0, raw.log_ns, asked
        before = message
        if n_same == FROZEN_N and asked is not None and asked_then is not None:
            moved = max(abs(a - b) for a, b in zip(asked, asked_then, strict=True))
            if moved > MOVING_RAD:
                detail = f"{FROZEN_N} measurements are the same while joints were told to move by {moved:.4f} rad"
                found.add("frozen", ARM_STATE.name, detail, at_ns=begun_ns)


def _look_at_frames(session: SessionFile, found: _Findings) -> None:
    """Pictures that are the same to the last bit: a camera that hangs, and goes on telling its last one."""
    before: dict[str, bytes] = {}
    n_same: dict[str, int] = {}
    for _, raw, image in session.messages(CAMERA_IMAGE):
        name, is_same = image.frame_id, before.get(image.frame_id) == image.data
        before[name], n_same[name] = image.data, n_same.get(name, 0) + 1 if is_same else 0
        if n_same[name] == N_SAME_FRAMES:
            detail = f"camera {name}: {N_SAME_FRAMES} pictures in a row are the one before, to the last bit"
            found.add("frozen", CAMERA_IMAGE.name, detail, at_ns=raw.log_ns)


def _look_at_limiters(session: SessionFile, found: _Findings) -> None:
    """Actions that were cut short more often than not, and intents that came to nothing."""
    n_steps, by_limiter, n_asked = 0, dict[str, int](), 0
    for topic, _, message in session.messages(STEP, INTENT):
        if topic is INTENT:
            n_asked += 1
            continue
        n_steps += 1
        for name in message.executed.limiters:
            by_limiter[name] = by_limiter.get(name, 0) + 1
    for name, n in sorted(by_limiter.items()):
        if n > OFTEN * n_steps:
            detail = f"{name} had a hand in {n} of {n_steps} steps"
            found.add("clipped actions", STEP.name, detail, severity=Severity.WARNING)
    if n_asked > n_steps + 1:
        found.add("asked, not carried out", INTENT.name, f"{n_asked} intents, {n_steps} steps")


def lines(checked: Checked) -> Iterator[str]:
    """Yield what a check came to, in words."""
    for finding in checked.findings:
        at = "" if finding.at_s is None else f" at {finding.at_s:.3f} s"
        where = f" {finding.topic}" if finding.topic else ""
        yield f"{finding.severity}: {finding.kind}{where}{at}: {finding.detail}"
    if checked.n_left_out:
        yield f"and {checked.n_left_out} more of the same kinds"
    if not checked.findings:
        yield "nothing is wrong with it"
