"""What a session was recorded with, as config. The edge: the loader reads files."""

from pathlib import Path
from tempfile import TemporaryDirectory

from config.loader import load_resolved
from config.resolved import Resolved
from robot.recording.errors import UnfitError
from robot.recording.recording import CONFIG
from robot.recording.session_file import SessionFile

__all__ = ["resolved_from", "resolved_of"]


def resolved_of(session: SessionFile) -> Resolved:
    """Return the config that a session was recorded with, checked as if it came from its files.

    Raises:
        UnfitError: none is attached.
        ConfigError: it is another version's.
    """
    text = session.attachment(CONFIG)
    if text is None:
        raise UnfitError(f"{session.path}: expected its config as {CONFIG}, nothing of that name is attached")
    return resolved_from(text)


def resolved_from(text: bytes) -> Resolved:
    """Return what config.resolved.dump_resolved wrote, checked as if it came from its files.

    Raises:
        ConfigError: it is another version's.
    """
    with TemporaryDirectory() as folder:
        path = Path(folder) / CONFIG
        path.write_bytes(text)
        return load_resolved(path)
