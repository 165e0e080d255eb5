"""Where a config file is: shipped by name inside this package, or a path of the user's own."""

import stat
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path

import msgspec

from config.decode import nearest
from config.errors import ConfigError

__all__ = ["MAX_BYTES", "Source", "is_path", "read_path", "read_source", "shipped_names"]

MAX_BYTES = 1_000_000


class Source(msgspec.Struct, frozen=True, kw_only=True):
    """The text of a config file."""

    file: str
    """What errors call it."""
    folder: Path | None
    """Where paths in it start from; None for a shipped file, which names shipped files only."""
    text: str


def read_source(folder: str, name: str | Path, *, base: Path | None = None) -> Source:
    """Return the text of a shipped file of that folder (`rules`, `scenarios`, ...) or of a path.

    Args:
        folder: the folder of this package that a plain name is looked for in.
        name: `paper`, or a path: whatever holds a slash or ends in .yaml or .yml.
        base: folder that a relative path starts from; the working directory if None.

    Raises:
        ConfigError: no such name or file, or not a text file of reasonable size.
    """
    if isinstance(name, Path) or is_path(name):
        return read_path(Path(name) if base is None else base / name)
    names = shipped_names(folder)
    if name not in names:
        got = f"{name!r}{nearest(name, names)}"
        raise ConfigError(folder, "", f"a path to a .yaml file or one of {', '.join(names)}", got)
    content = _shipped(folder).joinpath(f"{name}.yaml").read_bytes()
    file = f"{folder}/{name}.yaml"
    return Source(file=file, folder=None, text=_text(content, file))


def is_path(name: str) -> bool:
    """Return whether a name is a path of the user's own, and not a shipped file's."""
    return "/" in name or name.endswith((".yaml", ".yml"))


def read_path(path: Path) -> Source:
    """Return the text of a file of the user's own."""
    file = str(path) if str(path).isprintable() else ascii(str(path))
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise ConfigError(file, "", "a file", "a folder or a device")
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:
        raise ConfigError(file, "", "a file that can be read", _reason(error)) from error
    return Source(file=file, folder=path.parent, text=_text(content, file))


def shipped_names(folder: str) -> tuple[str, ...]:
    """Return the names of the files that this package ships in a folder."""
    entries = (entry.name for entry in _shipped(folder).iterdir())
    return tuple(sorted(entry.removesuffix(".yaml") for entry in entries if entry.endswith(".yaml")))


def _shipped(folder: str) -> Traversable:
    return resources.files("config").joinpath(folder)


def _text(content: bytes, file: str) -> str:
    if len(content) > MAX_BYTES:
        raise ConfigError(file, "", f"at most {MAX_BYTES} bytes", "more")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigError(file, "", "UTF-8 text", f"the byte 0x{content[error.start]:02x} at {error.start}") from error


def _reason(error: OSError | ValueError) -> str:
    return (error.strerror or str(error)).lower() if isinstance(error, OSError) else str(error)
