"""Cuts what is uploaded to ports 30001 to 30003 into programs. Pure.

UR's rule: a program starts with `def` or `sec` in column 1 and ends with `end` in column 1, its body is indented. Any
other line is a program of its own. Blank lines and comments between programs are nothing.
"""

import re

from sim_twin.controller.wire.lines import LineReader

__all__ = ["ScriptFramer"]

_OPENING = re.compile(r"(def|sec)\s")
_CLOSING = re.compile(r"end\s*(#.*)?$")
_N_LINE_BYTES = 65_536
_N_PROGRAM_CHARS = 1_048_576


class ScriptFramer:
    """One connection's upload.

    Attributes:
        is_overlong: A line or a program grew beyond every sane size; nothing more is read.
    """

    def __init__(self) -> None:
        self.is_overlong = False
        self._lines = LineReader(_N_LINE_BYTES)
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
        self.is_overlong = self._lines.is_overlong or self._n_chars > _N_PROGRAM_CHARS
        return programs

    def _take(self, line: str, programs: list[str]) -> None:
        if self._program:
            self._program.append(line)
            self._n_chars += len(line)
            if _CLOSING.match(line):
                programs.append("\n".join([*self._program, ""]))
                self._program.clear()
                self._n_chars = 0
        elif _OPENING.match(line):
            self._program.append(line)
        elif line.strip() and not line.lstrip().startswith("#"):
            programs.append(f"{line}\n")
