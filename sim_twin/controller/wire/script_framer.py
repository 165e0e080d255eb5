"""Cuts what is uploaded to ports 30001 to 30003 into programs. Pure.

UR's rule: a program starts with `def` or `sec` in column 1 and ends with `end` in column 1, its body is indented. Any
other line is a program of its own. Blank lines and comments between programs are nothing.
"""

import re

from sim_twin.controller.wire.lines import LineReader

__all__ = ["N_LINE_BYTES", "N_PROGRAM_CHARS", "N_PROGRAM_LINES", "ScriptFramer"]

_OPENING = re.compile(r"(def|sec)\s")
_CLOSING = re.compile(r"end\s*(#.*)?$")
N_LINE_BYTES = 65_536
N_PROGRAM_CHARS = 262_144
"""Of one program. ur_rtde's script has 42,000; one of this length takes seconds to compile."""
N_PROGRAM_LINES = 32_768
"""A line in memory takes some fifty bytes, however short it is."""


class ScriptFramer:
    """One connection's upload.

    Attributes:
        is_overlong: A line or a program grew beyond its limit; nothing more is read.
    """

    def __init__(self) -> None:
        self.is_overlong = False
        self._lines = LineReader(N_LINE_BYTES)
        self._program: list[str] = []
        self._n_chars = 0

    @property
    def is_inside(self) -> bool:
        """Whether a program has begun and its end has not come."""
        return bool(self._program)

    def feed(self, chunk: bytes) -> list[str]:
        """Return the programs that are complete now, each with its final newline."""
        if self.is_overlong:
            return []
        programs: list[str] = []
        for raw in self._lines.feed(chunk):
            self._take(raw.decode("utf-8", "replace"), programs)
            if self.is_overlong:
                return programs
        self.is_overlong = self._lines.is_overlong
        return programs

    def _take(self, line: str, programs: list[str]) -> None:
        if self._program:
            self._add(line)
            if not self.is_overlong and _CLOSING.match(line):
                programs.append("\n".join([*self._program, ""]))
                self._program.clear()
        elif _OPENING.match(line):
            self._n_chars = 0
            self._add(line)
        elif line.strip() and not line.lstrip().startswith("#"):
            programs.append(f"{line}\n")

    def _add(self, line: str) -> None:
        self._program.append(line)
        self._n_chars += len(line) + 1
        if self._n_chars > N_PROGRAM_CHARS or len(self._program) > N_PROGRAM_LINES:
            self._program.clear()
            self.is_overlong = True
