"""The percept of a table that is seen through a camera: each entry with its age, whether it holds, and how surely."""

import math
from collections.abc import Mapping

from config.arm import ArmConfig
from config.rig import Rig
from config.scenario import Scenario
from perception.calibration.camera_file import load_camera
from perception.detection import Detector, load_colours
from perception.detection.arm_outline import arm_outlines
from perception.detection.eye import Eye
from perception.errors import CameraSilentError, PerceptionConfigError
from perception.tracking import ArmCourse, TableTracks, Tracked
from perception.tracking.frames import FrameWatch
from robot.frames import CameraSpec, Frame
from robot.hal.protocols import Camera
from robot.messages import ArmState, ObjectPercept, Percept, SceneState

__all__ = ["CameraPerception"]

TABLE = "table"
FRESH_NS = 150_000_000
"""Where the newest picture is older, nothing that it showed is known any more."""
SILENT_NS = 600_000_000
"""Where it is so much older, the camera is lost."""


class CameraPerception:
    """P(t) from the newest picture that has arrived, the pictures before it, and the arm's own measurements.

    Implements robot.station_doors.Perceives and Sighted. What a simulated world gives away is not looked at.

    Attributes:
        eye: The camera as it was calibrated.
        shown_ns: When the newest picture that shows the table was exposed, forgotten or not; None before one.
    """

    def __init__(self, *, scenario: Scenario, arm: ArmConfig, rig: Rig) -> None:
        """Read the files of the rig's camera.

        Raises:
            PerceptionConfigError: the rig names no camera, or one that was not calibrated.
            ConfigError: a file is missing or wrong.
        """
        if rig.camera is None:
            raise PerceptionConfigError(f"rig {rig.name}: expected a camera for a perception by camera, it names none")
        file = load_camera(rig.camera.calibration)
        if file.name != rig.camera.name:
            raise PerceptionConfigError(
                f"rig {rig.name}: expected the calibration of camera {rig.camera.name}, came that of {file.name}"
            )
        self._arm, self._scenario, self._file = arm, scenario, file
        self.eye = Eye(file)
        self._detector = Detector(camera=file, scenario=scenario, colours=load_colours(rig.camera.colours))
        self._tracks, self._course = TableTracks(scenario), ArmCourse()
        self._names = tuple(t.name for t in (*scenario.buttons, *scenario.boxes, *scenario.cylinders))
        self._rate_hz = rig.camera.rate_hz
        self._camera: Camera | None = None
        self._frames = FrameWatch()
        self._began_ns: int | None = None
        self._newest_ns: int | None = None
        self._lit_ns: int | None = None
        """When the newest picture that shows the table was exposed."""
        self.shown_ns: int | None = None

    @property
    def camera_spec(self) -> CameraSpec:
        """Which camera it looks through, as that was calibrated."""
        lens = self._file.lens
        return CameraSpec(
            name=self._file.name, serial=self._file.serial, width_px=lens.width_px, height_px=lens.height_px,
            rate_hz=self._rate_hz,
        )  # fmt: skip

    def watch(self, cameras: Mapping[str, Camera]) -> None:
        """Take the camera to look through, of a plant's.

        Raises:
            PerceptionConfigError: it is not among them, or another one than was calibrated.
        """
        name, lens = self._file.name, self._file.lens
        if name not in cameras:
            raise PerceptionConfigError(f"expected camera {name}, the plant has {', '.join(cameras) or 'none'}")
        spec = cameras[name].spec
        size, serial = (spec.width_px, spec.height_px), self._file.serial
        if size != (lens.width_px, lens.height_px):
            raise PerceptionConfigError(f"camera {name}: calibrated at {lens.width_px} × {lens.height_px}, came {size}")
        if serial and spec.serial and serial != spec.serial:
            raise PerceptionConfigError(f"camera {name}: expected serial {serial} as calibrated, came {spec.serial}")
        self._camera = cameras[name]

    def connect(self) -> None:
        """Acquire the camera."""
        self._looked_through().connect()

    def forget(self) -> None:
        """Begin anew: the table was laid out by somebody."""
        self._course.forget()
        self._began_ns, self._newest_ns, self._frames = None, None, FrameWatch()

    def close(self) -> None:
        """Release the camera. Idempotent."""
        if self._camera is not None:
            self._camera.close()

    def perceive(self, arm: ArmState, scene: SceneState | None) -> Percept:
        """Return P(t), object poses and grip at the arm's stamp.

        Raises:
            CameraSilentError: no picture has come for too long.
        """
        del scene
        if self._began_ns is None:
            self._began_ns, self._lit_ns = arm.stamp_ns, None
            self._tracks.forget(arm.stamp_ns)
        self._course.note(arm)
        self._tracks.note_arm(arm)
        frame = self._looked_through().read(arm.stamp_ns)
        if frame is not None:
            self._look(frame)
        silence_ns = arm.stamp_ns - (self._began_ns if self._lit_ns is None else self._lit_ns)
        if silence_ns > SILENT_NS:
            raise CameraSilentError(
                f"camera {self._file.name}: expected a picture every {FRESH_NS / 1e6:.0f} ms, the last one that shows "
                f"the table is {silence_ns / 1e6:.0f} ms old: {self._what_is_wrong(arm.stamp_ns)}"
            )
        return self._percept(arm, is_fresh=silence_ns <= FRESH_NS)

    def _look(self, frame: Frame) -> None:
        """Take in a picture, the arm where it was when that was exposed."""
        posture = self._course.at(frame.stamp_ns)
        outlines = [] if posture is None else arm_outlines(self._arm, *posture, self.eye)
        seen = self._detector.look(frame, outlines, self._tracks.near(frame.sequence))
        self._tracks.note_picture(seen)
        self._frames.note(frame)
        self._newest_ns = frame.stamp_ns
        if seen.is_lit and not self._frames.is_frozen:
            self._lit_ns = self.shown_ns = frame.stamp_ns

    def _what_is_wrong(self, now_ns: int) -> str:
        """Return in words why no picture shows the table."""
        if self._newest_ns is None or now_ns - self._newest_ns > SILENT_NS:
            return "none came since; is it plugged in?"
        if self._frames.is_frozen:
            return "pictures come, and all are the same: it hangs; plug it in anew"
        return "pictures come, and show no lit table: is it covered, dark or over-exposed?"

    def _percept(self, arm: ArmState, *, is_fresh: bool) -> Percept:
        by_name = {name: self._tracks.thing(name, arm) for name in self._names}
        lamps = [self._tracks.lamp(button.name, arm.stamp_ns) for button in self._scenario.buttons]
        tcp = arm.tcp_position_m
        height = abs(tcp[2] - self._scenario.table.height_m)
        measured = Tracked(age_s=0.0, is_valid=True, confidence=1.0)  # the table's height is the arm's own knowledge
        entries = [measured if name == TABLE else by_name[name] for name in self._scenario.distances]
        distances = zip(self._scenario.distances, entries, strict=True)
        whole = [*entries, *lamps]
        return Percept(
            stamp_ns=arm.stamp_ns,
            distances_m=tuple([height if n == TABLE else math.dist(tcp, e.position_m) for n, e in distances]),
            button_states=tuple([1.0 if lamp.is_lit else 0.0 for lamp in lamps]),
            ages_s=tuple([e.age_s for e in whole]),
            valid=tuple([e.is_valid and (is_fresh or e is measured) for e in whole]),
            confidences=tuple([e.confidence for e in whole]),
            objects=tuple(
                [
                    ObjectPercept(
                        name=name, position_m=e.position_m, quat=e.quat, age_s=e.age_s,
                        is_valid=e.is_valid and is_fresh, confidence=e.confidence,
                    )
                    for name, e in by_name.items()
                ]
            ),
            tcp_position_m=tcp,
            grip=arm.grip,
            is_in_contact=False,
        )  # fmt: skip

    def _looked_through(self) -> Camera:
        if self._camera is None:
            raise PerceptionConfigError(f"camera {self._file.name}: expected a plant's camera to watch, none was given")
        return self._camera
