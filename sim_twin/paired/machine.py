"""Whether this machine had any processor time to spare: the evidence on which a disturbed measurement is dropped."""

from pathlib import Path
from typing import Self

__all__ = ["SPARE_SHARE", "Spare", "spare_share"]

_STAT = Path("/proc/stat")
IDLE, IOWAIT = 3, 4
SPARE_SHARE = 0.3
"""Where less than this of the processors' time was idle, processes had to wait for one another. Nobody else about, the
three that move an arm over the wire leave half of two."""


class Spare:
    """Measures from its beginning on which share of all processors' time nobody wanted."""

    def __init__(self) -> None:
        self._before: tuple[int, ...] = ()

    def begin(self) -> Self:
        """Begin, or begin anew."""
        self._before = _processor_times(_STAT.read_text(encoding="ascii"))
        return self

    def share(self) -> float:
        """Return the share since the beginning, 0 to 1; 1 where too little time has passed to tell."""
        return spare_share(self._before, _processor_times(_STAT.read_text(encoding="ascii")))


def spare_share(before: tuple[int, ...], after: tuple[int, ...]) -> float:
    """Return the idle share between two rows of processor times (proc_stat(5): user, nice, system, idle, iowait, …)."""
    spent = [b - a for a, b in zip(before, after, strict=True)]
    return (spent[IDLE] + spent[IOWAIT]) / sum(spent) if sum(spent) > 0 else 1.0


def _processor_times(text: str) -> tuple[int, ...]:
    """Return the first row's eight times of the processors together; guests' are part of the users'."""
    return tuple(int(number) for number in text.split("\n", 1)[0].split()[1:9])
