"""A terminal's bytes become keys, and keys become what a driver asks. Pure: no terminal, no clock of its own.

Two kinds of terminal. One tells of presses alone, and repeats a key that is held, after a first pause that is long: a
key counts as held for 150 ms from when it was seen last, so a first touch is a nudge. The other tells of releases too
(the keyboard protocol that began with kitty), which also bridges the pause: there a key is held until its release, as
long as the terminal goes on telling anything.
"""

import re
from collections.abc import Callable
from enum import StrEnum

import msgspec

from robot.messages import Grip, Vec3
from robot.teleop.device import DriverInput, EpisodeKey, Frame

__all__ = ["HELD_NS", "KEYS", "PAUSE_NS", "KeyBoard", "KeyEvent", "Kind", "decode"]

HELD_NS = 150_000_000
"""A key that was not seen for longer is released."""
PAUSE_NS = 700_000_000
"""The longest pause of a terminal between a key's press and its first repeat: X11's is 500 to 660 ms."""
SPEED_STEP, LEAST_SPEED = 0.1, 0.1

CSI = re.compile(rb"\x1b\[([?]?[0-9;:]*)([A-Za-z~])")
ESC = 0x1B
LETTERS = {b"A": "up", b"B": "down", b"C": "right", b"D": "left", b"I": "focus", b"O": "blur"}
TILDES = {"5": "pgup", "6": "pgdn"}
CODES = {27: "esc", 13: "enter", 32: "space", 9: "tab", 127: "backspace"}
KITTY = "kitty"
CTRL = 4


class Kind(StrEnum):
    """What happened to a key. A terminal of the first kind tells of presses alone."""

    PRESS = "press"
    REPEAT = "repeat"
    RELEASE = "release"


class KeyEvent(msgspec.Struct, frozen=True):
    """One key, as a terminal told it."""

    key: str
    kind: Kind = Kind.PRESS


MOVES: dict[str, tuple[Vec3, Vec3]] = {
    "w": ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "s": ((-1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    "a": ((0.0, 1.0, 0.0), (0.0, 0.0, 0.0)),
    "d": ((0.0, -1.0, 0.0), (0.0, 0.0, 0.0)),
    "r": ((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)),
    "f": ((0.0, 0.0, -1.0), (0.0, 0.0, 0.0)),
    "q": ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)),
    "e": ((0.0, 0.0, 0.0), (0.0, 0.0, -1.0)),
}
MOVES |= {"up": MOVES["w"], "down": MOVES["s"], "left": MOVES["a"], "right": MOVES["d"]}
MOVES |= {"pgup": MOVES["r"], "pgdn": MOVES["f"]}
EPISODES = {"n": EpisodeKey.NEXT, "b": EpisodeKey.REDO, "backspace": EpisodeKey.DISCARD}
OVER = ("x", "esc", "ctrl+c", "ctrl+d")
KEYS = (
    ("w/s", "x"),
    ("a/d", "y"),
    ("r/f", "z"),
    ("q/e", "turn"),
    ("o/c", "hand"),
    ("+/-", "speed"),
    ("t", "frame"),
    ("z", "clutch"),
    ("space", "stop"),
    ("n/b/backspace", "next, again, discard"),
    ("x", "end"),
)


def decode(raw: bytes) -> tuple[list[KeyEvent], bytes]:
    """Return the keys in a terminal's bytes, and what is left of a sequence that is not whole yet."""
    events: list[KeyEvent] = []
    while raw:
        if raw[0] == ESC:
            if raw in (b"\x1b", b"\x1b[") or (raw.startswith(b"\x1b[") and not CSI.match(raw) and _may_grow(raw)):
                return events, raw
            event, length = _escape(raw)
        else:
            length = _utf8_length(raw[0])
            if length > len(raw):
                return events, raw
            event = _plain(raw[:length])
        raw = raw[length:]
        events.append(event)
    return events, b""


def _may_grow(raw: bytes) -> bool:
    """Whether bytes may still become a sequence; so long a one is none."""
    return len(raw) < 32 and re.fullmatch(rb"\x1b\[[?]?[0-9;:]*", raw) is not None


def _escape(raw: bytes) -> tuple[KeyEvent, int]:
    """Return the key of an escape sequence and its length; of what is none, the escape key."""
    found = CSI.match(raw)
    if found is None:
        return KeyEvent("esc"), 1
    inner, last = found[1].decode(), found[2]
    if inner.startswith("?"):
        return KeyEvent(KITTY if last == b"u" else "unknown"), found.end()
    parts = inner.split(";")
    modifiers, _, kind = (parts[1] if len(parts) > 1 else "1").partition(":")
    happened = {"2": Kind.REPEAT, "3": Kind.RELEASE}.get(kind, Kind.PRESS)
    if last == b"u":
        key = _of_code(parts[0].partition(":")[0], modifiers)
    else:
        key = TILDES.get(parts[0], "unknown") if last == b"~" else LETTERS.get(last, "unknown")
    return KeyEvent(key, happened), found.end()


def _of_code(code: str, modifiers: str) -> str:
    number = int(code) if code else 0
    key = CODES.get(number) or (chr(number) if 32 < number < 0x110000 else "unknown")
    return f"ctrl+{key}" if modifiers.isdigit() and (int(modifiers) - 1) & CTRL else key


def _plain(raw: bytes) -> KeyEvent:
    if len(raw) == 1 and raw[0] < 32 and raw[0] not in CODES:
        return KeyEvent(f"ctrl+{chr(raw[0] + 96)}")
    if len(raw) == 1 and raw[0] in CODES:
        return KeyEvent(CODES[raw[0]])
    return KeyEvent(raw.decode(errors="replace"))


def _utf8_length(first: int) -> int:
    return 1 if first < 0xC0 else 2 if first < 0xE0 else 3 if first < 0xF0 else 4


class KeyBoard:
    """Which keys are held, and what they ask.

    Args:
        now_ns: the driver's time.
    """

    def __init__(self, *, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._held: dict[str, int] = {}
        """When each key that moves the arm was seen last."""
        self._touched: dict[str, int] = {}
        """The same of the keys that switch something over: one that is held must not go on switching."""
        self._heard_ns = 0
        self._is_newest_press = False
        self._tells_releases = False
        self._grip: Grip | None = None
        self._speed, self._frame, self._is_clutched, self._is_over = 1.0, Frame.BASE, False, False
        self._episode: EpisodeKey | None = None

    def feed(self, event: KeyEvent) -> None:
        """Take one key. Whatever is no key of the driver's, and a window that is left, lets go of everything."""
        now_ns = self._now_ns()
        if event.key == KITTY:
            self._tells_releases = True
        elif event.key in MOVES:
            self._move(event, now_ns)
        elif event.key != "focus" and event.kind is not Kind.RELEASE:
            self._switch(event, now_ns)

    def end(self) -> None:
        """The terminal is gone."""
        self._held.clear()
        self._is_over = True

    def asked(self) -> DriverInput:
        """Return what the keys ask now."""
        now_ns = self._now_ns()
        self._let_go(now_ns)
        moves = [MOVES[key] for key in self._held]
        episode, self._episode = self._episode, None
        return DriverInput(
            stamp_ns=now_ns,
            linear=_sum([linear for linear, _ in moves]),
            angular=_sum([angular for _, angular in moves]),
            is_held=bool(moves),
            is_clutched=self._is_clutched,
            grip=self._grip,
            speed_share=self._speed,
            frame=self._frame,
            is_over=self._is_over,
            episode=episode,
        )

    def _move(self, event: KeyEvent, now_ns: int) -> None:
        self._tells_releases |= event.kind is Kind.RELEASE
        self._heard_ns, self._is_newest_press = now_ns, event.kind is Kind.PRESS
        if event.kind is Kind.RELEASE:
            self._held.pop(event.key, None)
        else:
            self._held[event.key] = now_ns

    def _let_go(self, now_ns: int) -> None:
        """Release what was not seen for too long."""
        if self._tells_releases:
            patience_ns = PAUSE_NS if self._is_newest_press else HELD_NS
            if now_ns - self._heard_ns > patience_ns:
                self._held.clear()
        else:
            self._held = {key: seen for key, seen in self._held.items() if now_ns - seen <= HELD_NS}

    def _switch(self, event: KeyEvent, now_ns: int) -> None:
        key = event.key
        is_fresh = event.kind is Kind.PRESS and now_ns - self._touched.get(key, -PAUSE_NS - 1) > (
            0 if self._tells_releases else PAUSE_NS
        )
        self._touched[key] = now_ns
        match key:
            case "o" | "c":
                self._grip = Grip.OPEN if key == "o" else Grip.CLOSE
            case "+" | "=" | "-":
                step = -SPEED_STEP if key == "-" else SPEED_STEP
                self._speed = min(1.0, max(LEAST_SPEED, round(self._speed + step, 3)))
            case "t" | "z":
                self._held.clear()
                if is_fresh and key == "t":
                    self._frame = Frame.TOOL if self._frame is Frame.BASE else Frame.BASE
                elif is_fresh:
                    self._is_clutched = not self._is_clutched
            case "n" | "b" | "backspace":
                self._held.clear()
                if is_fresh:
                    self._episode = EPISODES[key]
            case _:
                self._held.clear()
                self._is_over |= key in OVER


def _sum(vectors: list[Vec3]) -> Vec3:
    x, y, z = (sum(axis) for axis in zip((0.0, 0.0, 0.0), *vectors, strict=True))
    return x, y, z
