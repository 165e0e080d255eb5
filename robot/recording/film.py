"""A short video of a session: its camera's frames, or arm and table drawn anew. The edge to OpenCV's writer.

What is drawn is what was measured and perceived; who draws is loaded by name, for this room knows no simulated world.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import msgspec
import numpy as np

from config.resolved import Resolved
from robot.bus.topics import ARM_STATE, CAMERA_IMAGE, PERCEPT, VERDICT
from robot.frames import Picture
from robot.messages import ArmState, Outcome, Percept
from robot.recording.errors import UnfitError
from robot.recording.images import decode_image, opencv
from robot.recording.origin import resolved_of
from robot.recording.session_file import SessionFile
from robot.recording.topics import EPOCH, EVENT, GOAL, RESET_MARK, SUBGOAL
from robot.recording.video import write_video
from robot.rigs import load

__all__ = ["DRAWER", "MOST_S", "Draws", "Moment", "moments", "save_film"]

DRAWER = "sim_twin.session_film:open_drawer"
RATE_HZ = 20.0
MOST_S = 60.0
"""A film that nobody said the end of is this long."""
SAID_S = 1.5
"""How long a refusal or an event is shown."""
MARGIN_PX, TEXT_PX = 12, 28
PAPER, INK = (245, 245, 245), (30, 30, 30)

Draws = Callable[[ArmState, Percept], Picture]


class Moment(msgspec.Struct, frozen=True, kw_only=True):
    """How things were at one time of a session."""

    at_s: float
    state: ArmState
    percept: Percept
    lines: tuple[str, ...]
    """What is said of it."""


def save_film(session: SessionFile, out: Path, *, from_s: float = 0.0, to_s: float | None = None) -> str:
    """Write a span of a session as a video, in its own time, and return what it was made of.

    Raises:
        UnfitError: there is nothing to show in it, or it cannot be written.
        RobotConfigError: OpenCV is not installed.
    """
    begin_s = from_s or _begin_s(session)
    end_s = begin_s + MOST_S if to_s is None else to_s
    frames = _frames(session, begin_s, end_s)
    first = next(frames, None)
    if first is not None:
        _write(out, _chained(first, frames))
        return "its camera's frames"
    opener: Callable[[Resolved], AbstractContextManager[Draws]] = load(DRAWER)
    with opener(resolved_of(session)) as draw:
        shown = ((draw(m.state, m.percept), m.lines) for m in moments(session, begin_s, end_s, rate_hz=RATE_HZ))
        first = next(shown, None)
        if first is None:
            raise UnfitError(f"{session.path}: expected measurements and percepts in that span, there are none")
        _write(out, _chained(first, shown))
    return "arm and table, drawn as they were measured and perceived"


def moments(session: SessionFile, from_s: float, to_s: float, *, rate_hz: float) -> Iterator[Moment]:
    """Yield how things were, at even times of the session."""
    state: ArmState | None = None
    percept: Percept | None = None
    said: dict[str, tuple[float, str]] = {}
    due_s = from_s
    topics = (ARM_STATE, PERCEPT, VERDICT, GOAL, SUBGOAL, EPOCH, EVENT, RESET_MARK)
    for topic, raw, message in session.messages(*topics):
        at_s = raw.log_ns / 1e9
        while state is not None and percept is not None and due_s <= min(at_s, to_s):
            yield Moment(at_s=due_s, state=state, percept=percept, lines=_lines(said, due_s, from_s))
            due_s += 1.0 / rate_hz
        if at_s > to_s:
            return
        if topic is ARM_STATE:
            state = message
        elif topic is PERCEPT:
            percept = message
        else:
            _say(said, topic.name, at_s, message)
        if state is None or percept is None:
            due_s = max(due_s, at_s)


def _say(said: dict[str, tuple[float, str]], topic: str, at_s: float, message: msgspec.Struct) -> None:
    """Keep what is said of the times that follow."""
    forever = float("inf")
    match topic:
        case GOAL.name:
            said[topic] = (forever, f"goal {getattr(message, 'name', '')}")
        case SUBGOAL.name:
            said[topic] = (forever, f"sub-goal {getattr(message, 'name', '')}")
        case EPOCH.name:
            said[topic] = (at_s + SAID_S, "achieved" if getattr(message, "is_achieved", False) else "not achieved")
        case EVENT.name:
            said[topic] = (at_s + SAID_S, str(getattr(message, "what", "")))
        case VERDICT.name if getattr(message, "outcome", None) is Outcome.REFUSED:
            said[topic] = (at_s + SAID_S, f"refused: {getattr(message, 'reason', '')}")
        case RESET_MARK.name:
            said.pop(SUBGOAL.name, None)
        case _:
            pass


def _lines(said: dict[str, tuple[float, str]], at_s: float, from_s: float) -> tuple[str, ...]:
    return (f"{at_s - from_s:.2f} s", *(text for until_s, text in said.values() if at_s <= until_s))


def _frames(session: SessionFile, from_s: float, to_s: float) -> Iterator[tuple[Picture, tuple[str, ...]]]:
    """Yield the camera's frames at even times."""
    due_s = from_s
    for _, raw, image in session.messages(CAMERA_IMAGE):
        at_s = raw.log_ns / 1e9
        if at_s < from_s:
            due_s = at_s
            continue
        picture = decode_image(image) if due_s <= at_s <= to_s else None
        while picture is not None and due_s <= at_s:
            yield picture, (f"{due_s - from_s:.2f} s  camera {image.frame_id}",)
            due_s += 1.0 / RATE_HZ


def _begin_s(session: SessionFile) -> float:
    """Return when the session began, by its own clock."""
    return 0.0 if session.statistics is None else session.statistics.start_ns / 1e9


def _chained(
    first: tuple[Picture, tuple[str, ...]], rest: Iterable[tuple[Picture, tuple[str, ...]]]
) -> Iterator[tuple[Picture, tuple[str, ...]]]:
    yield first
    yield from rest


def _write(out: Path, pictures: Iterator[tuple[Picture, tuple[str, ...]]]) -> None:
    write_video(out, (_captioned(picture, lines) for picture, lines in pictures), rate_hz=RATE_HZ)


def _captioned(picture: Picture, lines: tuple[str, ...]) -> Picture:
    cv2 = opencv()
    shown = np.ascontiguousarray(picture)
    for i, line in enumerate(lines):
        at = (MARGIN_PX, TEXT_PX * (i + 1))
        (wide, tall), _ = cv2.getTextSize(line, cv2.FONT_HERSHEY_SIMPLEX, 0.6, 1)
        corner = (at[0] + wide + MARGIN_PX // 2, at[1] + MARGIN_PX // 2)
        cv2.rectangle(shown, (at[0] - MARGIN_PX // 2, at[1] - tall - MARGIN_PX // 2), corner, PAPER, -1)
        cv2.putText(shown, line, at, cv2.FONT_HERSHEY_SIMPLEX, 0.6, INK, 1, cv2.LINE_AA)
    return shown
