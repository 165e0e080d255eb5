"""Has the kernel end a process with the one that started it, however that ends. Linux only. The edge."""

import ctypes
import signal

__all__ = ["end_with_parent"]

PDEATHSIG = 1
_libc = ctypes.CDLL(None, use_errno=True)


def end_with_parent(number: signal.Signals = signal.SIGKILL) -> None:
    """Ask the kernel to send this process a signal when its parent is gone, killed or not. Called in the child."""
    _libc.prctl(PDEATHSIG, number)
