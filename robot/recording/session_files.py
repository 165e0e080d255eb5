"""Which file a running rig is recorded into: one after another, each begun where a learner's account can be replayed.

The edge: files. Nothing is overwritten; a recorder that was started anew goes on with the next number.
"""

from base64 import b64decode
from collections.abc import Callable
from pathlib import Path

from config.resolved import Resolved
from robot.recording.flight import Flight
from robot.recording.messages import Purpose, StationMark
from robot.recording.opening import Opening
from robot.recording.origin import resolved_from
from robot.recording.recording import STATE, Recording
from robot.recording.topics import STATION

__all__ = ["SessionFiles"]


class SessionFiles:
    """Begins files in a folder.

    Args:
        folder: made where there is none.
        resolved: the rig and its table, for files that no learner opens.
        person: who attends.
        tell: is told in words when something is lost.
    """

    def __init__(
        self, folder: Path, resolved: Resolved, *, person: str, tell: Callable[[str], object] = lambda _: None
    ) -> None:
        self._folder, self._resolved, self._person, self._tell = folder, resolved, person, tell
        self._flight = Flight(tell=tell)

    def watch(self) -> Recording:
        """Begin a file of what goes over the bus alone."""
        return self._begin(self._resolved, purpose=Purpose.WATCH)

    def go_on(self, account: int) -> Recording:
        """Begin a file that goes on with an account whose opening is in an earlier one: merged they are replayed."""
        return self._begin(self._resolved, purpose=Purpose.WATCH, about={"continues": str(account)})

    def open(self, opening: Opening, *, log_ns: int) -> Recording:
        """Begin a file that can be replayed alone.

        Raises:
            ConfigError: its config is another version's.
        """
        recording = self._begin(
            resolved_from(opening.config.encode()), purpose=Purpose.LEARN, seed=opening.seed,
            about={"learner": opening.learner, "n_done": str(opening.n_done)},
            attached={STATE: b64decode(opening.state)},
        )  # fmt: skip
        recording.recorder.write(STATION, StationMark(spec=opening.spec, is_driven=False), log_ns=log_ns)
        return recording

    def _begin(
        self, resolved: Resolved, *, purpose: Purpose, seed: int = 0, about: dict[str, str] | None = None,
        attached: dict[str, bytes] | None = None,
    ) -> Recording:  # fmt: skip
        return Recording(
            self._free(), resolved, purpose=purpose, seed=seed, person=self._person, about=about, attached=attached,
            tell=self._tell, flight=self._flight,
        )  # fmt: skip

    def close(self) -> None:
        """Finish what is written of a stop. Idempotent."""
        self._flight.close()

    def _free(self) -> Path:
        n = 1
        while (path := self._folder / f"session-{n:04d}.mcap").exists():
            n += 1
        return path
