"""What a commander leaves in shared memory, for whoever judges it after it was killed: when it asked for what."""

from collections.abc import MutableSequence
from multiprocessing.sharedctypes import RawArray
from typing import TypeAlias

__all__ = ["Log", "new_log"]

N_KEPT = 64
_ASKED, _GOOD, _REFUSED, _MIDWAY, _FAILED, _PID, _HEAD = range(7)

Cells: TypeAlias = MutableSequence[float]


def new_log() -> Cells:
    """Return the shared memory of one log."""
    return RawArray("d", _HEAD + 2 * N_KEPT)


class Log:
    """Both sides' view of it: the commander writes, the judge reads. Times are the host's monotonic, in s."""

    def __init__(self, cells: Cells) -> None:
        self._cells = cells

    # ------------------------------------------------------------------------------------------------- commander

    def ask(self, now_s: float) -> None:
        """Note that an intent is sent now."""
        k = _HEAD + 2 * (int(self._cells[_ASKED]) % N_KEPT)
        self._cells[k], self._cells[k + 1] = now_s, 1.0
        self._cells[_ASKED] += 1

    def take_back(self) -> None:
        """Note that what was sent last was refused, and never carried out."""
        self._cells[_HEAD + 2 * ((int(self._cells[_ASKED]) - 1) % N_KEPT) + 1] = 0.0

    def carried_out(self, *, is_midway: bool) -> None:
        """Note that it was carried out, and whether the arm is at full speed, far from turning."""
        self._cells[_GOOD] += 1
        self._cells[_MIDWAY] = is_midway

    def refuse(self, now_s: float) -> None:
        """Note that what was asked for was not, or not in full, carried out."""
        self._cells[_MIDWAY] = 0.0
        self._cells[_REFUSED] += 1
        if not self._cells[_FAILED]:
            self._cells[_FAILED] = now_s

    def begin(self, servo_pid: int | None) -> None:
        """Note that the arm was taken, by which servo process."""
        self._cells[_GOOD] = self._cells[_MIDWAY] = self._cells[_FAILED] = self._cells[_REFUSED] = 0.0
        self._cells[_PID] = servo_pid or 0

    # ----------------------------------------------------------------------------------------------------- judge

    @property
    def is_midway(self) -> bool:
        """Whether the arm is at full speed, far from turning."""
        return bool(self._cells[_MIDWAY])

    @property
    def n_good(self) -> int:
        """Time steps carried out since the arm was taken."""
        return int(self._cells[_GOOD])

    @property
    def n_refused(self) -> int:
        """Time steps refused since it was taken, or since the process began."""
        return int(self._cells[_REFUSED])

    @property
    def failed_s(self) -> float | None:
        """When one was refused first since the arm was taken; None where none was."""
        return self._cells[_FAILED] or None

    @property
    def servo_pid(self) -> int:
        """The servo process that holds the arm."""
        return int(self._cells[_PID])

    def last_s(self, until_s: float) -> float | None:
        """Return when the last intent was sent that was not refused, up to a time."""
        n = int(self._cells[_ASKED])
        kept = [_HEAD + 2 * (k % N_KEPT) for k in range(max(0, n - N_KEPT), n)]
        sent = [self._cells[k] for k in kept if self._cells[k + 1] and self._cells[k] <= until_s]
        return max(sent, default=None)
