"""The version that the controller announces; layouts and fields depend on it."""

import msgspec

__all__ = ["ControllerVersion"]

_CB3_MAJOR = 3


class ControllerVersion(msgspec.Struct, frozen=True, kw_only=True):
    """PolyScope's version: 3.x runs a CB3 box, 5.x an e-Series."""

    major: int = 5
    minor: int = 11
    bugfix: int = 0
    build: int = 108249

    @property
    def is_cb3(self) -> bool:
        """Whether the box is a CB3, which serves 125 Hz and fewer fields."""
        return self.major <= _CB3_MAJOR

    def has(self, since_e: tuple[int, ...] | None, since_cb3: tuple[int, ...] | None) -> bool:
        """Tell whether something that came with these versions exists here; None means that it never came."""
        since = since_cb3 if self.is_cb3 else since_e
        return since is not None and (self.major, self.minor, self.bugfix) >= since

    def __str__(self) -> str:
        return f"{self.major}.{self.minor}.{self.bugfix}.{self.build}"
