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
from robot.recording.flight import Flight, FlightTicks
from robot.recording.images import image_coder
from robot.recording.messages import Purpose
from robot.recording.picture import Picture
from robot.recording.recorder import Recorder
from robot.recording.shown import Shown
from robot.recording.sink import Sink
from robot.recording.taps import RecordedDrive, RecordedStation, RecordedTicks, WritesBytes
from robot.recording.told_ticks import THINNED, TakenTicks
from robot.recording.topics import LANES, RECORDED
from robot.revision import git_revision
from robot.station import Station
from robot.teleop.driver import DrivenStation
from robot.tick_ring import TickReader

__all__ = ["CONFIG", "FORMAT", "STATE", "STOPPED", "STOPS", "UNNAMED", "Recording"]

FORMAT = "1"
CONFIG, MODEL, VERSIONS, STATE = "config.yaml", "arm.xml", "versions.json", "learner_state.zip"
"""Names of attachments. A learner's state is there where a run was gone on with."""
UNNAMED = "unnamed"
WHOLE = "whole"
STOPS = "stops"
"""Folder of what led to stops."""
STOPPED = "stop"
"""Key of a stop's file's metadata: why the arm was stopped."""


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
        flight: a flight recorder that goes on from another session of the same rig; one of its own if left out.

    Attributes:
        recorder: Takes more.
        ticks: Listens to a tick loop in this process.
        heard: Digest of the percepts and outcomes of epochs that are for what the recording is for.
        wire_ticks: Takes every tick of an arm on a wire: into the session, or where only stops need them.
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
        flight: Flight | None = None,
    ) -> None:
        is_lock_step = resolved.rig.bus is None
        self._now_ns = None if is_lock_step else monotonic_ns
        self._resolved, self._purpose = resolved, purpose
        self.path, self._tell = path, tell
        self._own_flight = Flight(tell=tell) if flight is None else None
        flight = self._own_flight or flight
        is_whole = is_lock_step or resolved.rig.recorded_ticks == WHOLE
        unkept = () if is_whole else THINNED
        self.recorder = Recorder(
            Sink(path, may_wait=is_lock_step), lanes=LANES, tell=tell, keeps=flight, unkept=unkept
        )  # fmt: skip
        assert flight is not None, "one is made where none is given"
        self.wire_ticks: WritesBytes = self.recorder if is_whole else FlightTicks(flight)
        images = image_coder(resolved.rig.camera)
        self.ticks = RecordedTicks(self.recorder, now_ns=self._now_ns, images=images)
        self._said = self._about(seed, person) | dict(about or {})
        self._files = _files_of(resolved)
        self._head(self.recorder, {})
        for name, content in (attached or {}).items():
            self.recorder.attach(name, "application/octet-stream", content)
        flight.follow(self._begin_stop)
        self._taken: TakenTicks | None = None
        self._is_begun = False
        self.heard = sha256()

    def station(
        self, station: Station, *, purpose: Purpose | None = None, measure: Callable[[], ArmState] | None = None,
        ticks: TickReader | None = None,
    ) -> RecordedStation:  # fmt: skip
        """Return a station that is recorded; the first one's spec goes into the file.

        Args:
            station: what is recorded.
            purpose: what its epochs are for; the recording's own if left out.
            measure: returns the newest measurement, needed where ticks are not heard in this process.
            ticks: reads those of a process that holds the arm for this one; None where another one does.
        """
        resolved = self._resolved
        is_own = purpose in (None, self._purpose)
        heard = RecordedStation(
            station, self.recorder, purpose=purpose or self._purpose, ticks=self.ticks,
            picture=Picture(resolved.arm, resolved.scenario), now_ns=self._now_ns,
            heard=self.heard if is_own else None, measure=None if self._now_ns is None else measure,
            more_ticks=self._tick_source(ticks),
        )  # fmt: skip
        if not self._is_begun:
            self._is_begun = True
            heard.begin(is_driven=False)
        return heard

    def drive(self, station: DrivenStation, *, ticks: TickReader | None = None) -> RecordedDrive:
        """Return a driven station that is recorded, and the ticks of a process that holds its arm for this one."""
        resolved = self._resolved
        heard = RecordedDrive(
            station, self.recorder, ticks=self.ticks, picture=Picture(resolved.arm, resolved.scenario),
            now_ns=self._now_ns, measure=None if self._now_ns is None else lambda: station.measured,
            more_ticks=self._tick_source(ticks),
        )  # fmt: skip
        heard.begin(is_driven=True)
        return heard

    def _tick_source(self, ticks: TickReader | None) -> Callable[[], bool] | None:
        """Return what records the ticks of an arm that is held by this process's own servo process."""
        if ticks is not None and self._now_ns is not None and self._taken is None:
            self._taken = TakenTicks(ticks, self.wire_ticks, is_aside=self.are_ticks_aside)
        return None if ticks is None else self._taken

    @property
    def are_ticks_aside(self) -> bool:
        """Whether the session has an arm's ticks thinned, and every one only around a stop."""
        return self.wire_ticks is not self.recorder

    @property
    def is_on_a_wire(self) -> bool:
        """Whether its arm is held by a process that tells every tick."""
        return self._resolved.rig.bus is not None

    def shown(self) -> Shown:
        """Return what draws for viewers what is heard of over a bus."""
        return Shown(self.recorder, Picture(self._resolved.arm, self._resolved.scenario))

    def at_ns(self) -> int:
        """Return the session's time."""
        return self.ticks.log_ns if self._now_ns is None else self._now_ns()

    def close(self) -> None:
        """Finish the file. Idempotent."""
        if self._taken is not None:
            self._taken()
        if self._own_flight is not None:
            self._own_flight.close()
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

    def _head(self, recorder: Recorder, more: Mapping[str, str]) -> None:
        """Write what a file begins with."""
        recorder.note("session", {**self._said, **more})
        for name, media_type, content in self._files:
            recorder.attach(name, media_type, content)
        recorder.prepare(RECORDED)

    def _begin_stop(self, why: str, at_ns: int) -> Recorder:
        """Begin a file of what led to a stop, in a folder beside this one's: nobody takes it for a session."""
        n, folder = 1, self.path.parent / STOPS
        while (path := folder / f"{self.path.stem}-{n:03d}.mcap").exists():
            n += 1
        recorder = Recorder(Sink(path, may_wait=True), lanes=LANES, tell=self._tell)
        self._head(recorder, {"purpose": Purpose.WATCH.value, STOPPED: why, "stop_ns": str(at_ns)})
        self._tell(f"the arm was stopped ({why}): what led to it is in {path}")
        return recorder


def _files_of(resolved: Resolved) -> list[tuple[str, str, bytes]]:
    """Return names, kinds and contents of what is attached to every file."""
    here = bench_report("session", (), seconds=0.0)
    with TemporaryDirectory() as folder:
        path = Path(folder) / MODEL
        write_mjcf(resolved.arm, path)
        model = path.read_bytes()
    told = msgspec.json.format(msgspec.json.encode({"versions": here.versions, "machine": here.machine}), indent=2)
    return [
        (CONFIG, "application/yaml", dump_resolved(resolved).encode()),
        (MODEL, "application/xml", model),
        (VERSIONS, "application/json", told),
    ]
