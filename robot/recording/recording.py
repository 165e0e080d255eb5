"""A recording from its beginning to its end: which file, what is told of it, and what listens. The edge.

In lock-step times are the arm's own and nothing of the host's clock goes in: the same run makes the same file. On a
wire times are the host's monotonic clock, and the metadata say what the wall's clock showed when it began.
"""

from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic_ns

import msgspec

from config.resolved import Resolved, dump_resolved
from robot.bench import bench_report
from robot.description import write_mjcf
from robot.messages import ArmState
from robot.recording.messages import Purpose
from robot.recording.picture import Picture
from robot.recording.recorder import Recorder
from robot.recording.sink import Sink
from robot.recording.taps import RecordedDrive, RecordedStation, RecordedTicks
from robot.recording.topics import LANES, RECORDED
from robot.revision import git_revision
from robot.station import Station
from robot.teleop.driver import DrivenStation

__all__ = ["CONFIG", "FORMAT", "STATE", "UNNAMED", "Recording"]

FORMAT = "1"
CONFIG, MODEL, VERSIONS, STATE = "config.yaml", "arm.xml", "versions.json", "learner_state.zip"
"""Names of attachments. A learner's state is there where a run was gone on with."""
UNNAMED = "unnamed"


class Recording:
    """Records one run on one rig.

    Args:
        path: a file that is not there yet.
        resolved: what the run is made of.
        purpose: what its epochs are for.
        seed: root seed of the run.
        person: who drives or attends, as they want to be called in the file.
        about: more metadata.
        attached: more files.
        tell: is told in words when something is lost.

    Attributes:
        recorder: Takes more.
        ticks: Listens to a tick loop in this process.
        heard: Digest of the percepts and outcomes of epochs that are for what the recording is for.
    """

    def __init__(
        self,
        path: Path,
        resolved: Resolved,
        *,
        purpose: Purpose,
        seed: int,
        person: str = UNNAMED,
        about: Mapping[str, str] | None = None,
        attached: Mapping[str, bytes] | None = None,
        tell: Callable[[str], object] = lambda _: None,
    ) -> None:
        is_lock_step = resolved.rig.bus is None
        self._now_ns = None if is_lock_step else monotonic_ns
        self._resolved, self._purpose = resolved, purpose
        self.path = path
        self.recorder = Recorder(Sink(path, may_wait=is_lock_step), lanes=LANES, tell=tell)
        self.ticks = RecordedTicks(self.recorder, now_ns=self._now_ns)
        self.recorder.note("session", self._about(seed, person) | dict(about or {}))
        self._attach(attached or {})
        self.recorder.prepare(RECORDED)
        self._is_begun = False
        self.heard = sha256()

    def station(
        self, station: Station, *, purpose: Purpose | None = None, measure: Callable[[], ArmState] | None = None
    ) -> RecordedStation:
        """Return a station that is recorded; the first one's spec goes into the file.

        Args:
            station: what is recorded.
            purpose: what its epochs are for; the recording's own if left out.
            measure: returns the newest measurement, needed where ticks are not heard in this process.
        """
        resolved = self._resolved
        is_own = purpose in (None, self._purpose)
        heard = RecordedStation(
            station, self.recorder, purpose=purpose or self._purpose, ticks=self.ticks,
            picture=Picture(resolved.arm, resolved.scenario), now_ns=self._now_ns,
            heard=self.heard if is_own else None, measure=None if self._now_ns is None else measure,
        )  # fmt: skip
        if not self._is_begun:
            self._is_begun = True
            heard.begin(is_driven=False)
        return heard

    def drive(self, station: DrivenStation) -> RecordedDrive:
        """Return a driven station that is recorded."""
        resolved = self._resolved
        heard = RecordedDrive(
            station, self.recorder, ticks=self.ticks, picture=Picture(resolved.arm, resolved.scenario),
            now_ns=self._now_ns, measure=None if self._now_ns is None else lambda: station.measured,
        )  # fmt: skip
        heard.begin(is_driven=True)
        return heard

    def at_ns(self) -> int:
        """Return the session's time."""
        return self.ticks.log_ns if self._now_ns is None else self._now_ns()

    def close(self) -> None:
        """Finish the file. Idempotent."""
        self.recorder.close()

    def _about(self, seed: int, person: str) -> dict[str, str]:
        rig = self._resolved.rig
        told = {
            "format": FORMAT,
            "autotelic": version("autotelic"),
            "git": git_revision() or "unknown",
            "rig": rig.name,
            "scenario": self._resolved.scenario.name,
            "plant": rig.expected.kind,
            "model": rig.expected.model,
            "serial": rig.expected.serial,
            "purpose": self._purpose.value,
            "seed": str(seed),
            "person": person,
            "clock": "arm" if self._now_ns is None else "host",
        }
        if self._now_ns is None:
            return told
        return told | {"monotonic_ns": str(self._now_ns()), "wall": datetime.now(UTC).isoformat()}

    def _attach(self, more: Mapping[str, bytes]) -> None:
        here = bench_report("session", (), seconds=0.0)
        self.recorder.attach(CONFIG, "application/yaml", dump_resolved(self._resolved).encode())
        with TemporaryDirectory() as folder:
            path = Path(folder) / MODEL
            write_mjcf(self._resolved.arm, path)
            self.recorder.attach(MODEL, "application/xml", path.read_bytes())
        told = msgspec.json.format(msgspec.json.encode({"versions": here.versions, "machine": here.machine}), indent=2)
        self.recorder.attach(VERSIONS, "application/json", told)
        for name, content in more.items():
            self.recorder.attach(name, "application/octet-stream", content)
