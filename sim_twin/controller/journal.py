"""What the controller says: a log of its own, and robot messages for the primary port."""

from collections import deque
from collections.abc import Callable

import msgspec

from sim_twin.controller.script.builtins import Popup
from sim_twin.controller.states import SafetyMode
from sim_twin.controller.wire.primary_messages import (
    ReportLevel,
    pack_error_code,
    pack_key,
    pack_popup,
    pack_runtime_exception,
    pack_safety_mode,
    pack_text,
)

__all__ = ["Journal"]

N_LINES = 1000
N_SHOWN = 500
"""Characters of a text in the log or a message; some hundred are what a person sees of it on a robot."""
N_MESSAGES = 20
"""Texts and popups of programs in one slice; what comes after them is counted."""
_UNKNOWN = (0, 0)
_STOPS = frozenset(SafetyMode) - {SafetyMode.NORMAL, SafetyMode.REDUCED, SafetyMode.RECOVERY}
_LEVELS = {SafetyMode.VIOLATION: ReportLevel.VIOLATION, SafetyMode.FAULT: ReportLevel.FAULT}


class Journal:
    """Lines with their slice, messages that wait to be sent, the popup that is open.

    Args:
        stamp_us: The controller's own time.

    Attributes:
        lines: The log's last lines, each (stamp in µs, text).
        outbox: Robot messages as bytes; whoever owns the ports takes them.
        remarks: Errors in words, for RTDE's clients; whoever owns the ports takes them.
        safety_mode: As it was last told.
        popup: What a person is asked to read, None where nothing is.
    """

    def __init__(self, *, stamp_us: Callable[[], int]) -> None:
        self._stamp_us = stamp_us
        self.lines: deque[tuple[int, str]] = deque(maxlen=N_LINES)
        self.outbox: deque[bytes] = deque(maxlen=N_LINES)
        self.remarks: deque[str] = deque(maxlen=N_LINES)
        self.popup: Popup | None = None
        self.safety_mode = SafetyMode.NORMAL
        self._why: tuple[int, int] | None = None
        self._n_said = 0

    def note(self, text: str) -> None:
        """Write a line to the log."""
        self.lines.append((self._stamp_us(), text[:N_SHOWN]))

    def log(self, text: str) -> None:
        """Take a program's textmsg."""
        if self._is_heard():
            self._say(text)

    def end_slice(self) -> None:
        """Say how much of what programs had to say in this slice was left out, where they said too much."""
        if self._n_said > N_MESSAGES:
            self._say(f"{self._n_said - N_MESSAGES} messages left out")
        self._n_said = 0

    def show(self, popup: Popup) -> None:
        """Open a program's popup."""
        popup = msgspec.structs.replace(popup, title=popup.title[:N_SHOWN], text=popup.text[:N_SHOWN])
        self.popup = popup
        if not self._is_heard():
            return
        self.note(f"popup {popup.title}: {popup.text}")
        self.outbox.append(
            pack_popup(
                popup.title,
                popup.text,
                stamp_us=self._stamp_us(),
                is_warning=popup.is_warning,
                is_error=popup.is_error,
                is_blocking=popup.is_blocking,
            )
        )

    def is_popup_open(self) -> bool:
        """Return whether a popup waits to be read."""
        return self.popup is not None

    def key(self, title: str, text: str) -> None:
        """Say what became of a program, such as PROGRAM_XXX_STARTED and its name."""
        self.note(f"{title}: {text}")
        self.outbox.append(pack_key(0, stamp_us=self._stamp_us(), title=title, text=text[:N_SHOWN]))

    def exception(
        self, *, program: str, thread: str, line: int, column: int, message: str, as_reported: str = ""
    ) -> None:
        """Say where a program failed, and why: to the log, and as a robot reports it on the primary port."""
        self.note(f"program {program}, thread {thread}, line {line}: {message}")
        text = (as_reported or message)[:N_SHOWN]
        self.remarks.append(text)
        self.outbox.append(pack_runtime_exception(line, column, text, stamp_us=self._stamp_us()))

    def error(self, code: int, argument: int, text: str, *, is_violation: bool = False) -> None:
        """Say why the robot stops; the change of the safety mode that follows is told with the same code."""
        self.note(f"C{code}A{argument}: {text}")
        self.remarks.append(f"C{code}A{argument}: {text}"[:N_SHOWN])
        self._report(code, argument, text, ReportLevel.VIOLATION if is_violation else ReportLevel.WARNING)
        self._why = code, argument

    def safety(self, mode: SafetyMode) -> None:
        """Take the safety mode, and say so where it is another one.

        A stop for which nobody gave a reason is an error too, of code 0: UR's numbers for them are not known.
        """
        why, self._why = self._why, None
        if mode is self.safety_mode:
            return
        self.safety_mode = mode
        text = f"safety mode changed to {mode.name}"
        self.note(text)
        if why is None and mode in _STOPS:
            self._report(*_UNKNOWN, text, _LEVELS.get(mode, ReportLevel.WARNING))
        code, argument = why or _UNKNOWN
        self.outbox.append(pack_safety_mode(code, argument, stamp_us=self._stamp_us(), safety_mode=mode))

    def _is_heard(self) -> bool:
        self._n_said += 1
        return self._n_said <= N_MESSAGES

    def _say(self, text: str) -> None:
        self.note(text)
        self.outbox.append(pack_text(text[:N_SHOWN], stamp_us=self._stamp_us()))

    def _report(self, code: int, argument: int, text: str, level: ReportLevel) -> None:
        self.outbox.append(pack_error_code(code, argument, stamp_us=self._stamp_us(), level=level, text=text))
