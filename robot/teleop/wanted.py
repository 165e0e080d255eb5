"""What a person asked of `teleop check`, and what is answered."""

from pathlib import Path

import msgspec
from rich.console import RenderableType

__all__ = ["Answer", "Wanted"]


class Wanted(msgspec.Struct, frozen=True, kw_only=True):
    """The command's options, checked."""

    seed: int = 0
    full: bool = False
    json: bool = False
    out: Path | None = None
    """Folder for the report, the figure and the streams that were run: the same command goes on there."""
    stream: int | None = None
    """One stream alone, by its number."""
    mutate: bool = False
    """Weaken each limit of the stack alone and see that the battery tells."""
    probe: bool = False
    """Move the arm by a short, slow list, a person attending."""
    n_commands: int | None = None
    """Commands a stream; None for the battery's own."""
    n_blocks: int | None = None
    """So many blocks of the battery only, for a quick look."""
    n_workers: int | None = None
    """Processes; None for one a processor."""


class Answer(msgspec.Struct, frozen=True, kw_only=True):
    """What a check came to."""

    json: str
    shown: tuple[RenderableType, ...]
    """The same for a person."""
    is_passed: bool
