"""What tests of refusals share: the words, whole, and a host's time that stands until it is moved."""

import re

__all__ = ["HostTime", "says"]


def says(message: str) -> str:
    """Returns the pattern for ``pytest.raises`` that only the whole message matches."""
    return f"^{re.escape(message)}$"


class HostTime:
    """A clock in nanoseconds; whoever tests moves it."""

    def __init__(self, now_ns: int = 5_000_000_000) -> None:
        self.now_ns = now_ns

    def __call__(self) -> int:
        return self.now_ns
