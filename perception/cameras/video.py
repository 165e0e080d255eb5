"""A video file as a camera: what was filmed once comes again at the rate that it was filmed at. The edge to OpenCV."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from config.arm import ArmConfig
from config.rig import Rig
from config.scenario import Scenario
from perception.cameras.named import named_camera
from perception.errors import PerceptionConfigError
from perception.opencv import opencv
from robot.errors import WireError
from robot.frames import Frame, frame_of

if TYPE_CHECKING:
    from robot.bus import Bus

__all__ = ["VideoCamera"]

NS = 1e9
LEAST_HZ, MOST_HZ = 1.0, 240.0


class VideoCamera:
    """Gives the frames of a video file, each once, the first at the first read (robot.hal.protocols.Camera).

    Frames that were due between two reads and are not the newest are passed over; their numbers are missing. After the
    last one nothing comes until it is connected to anew.

    Args:
        rig: its camera's device is the file.

    Attributes:
        spec: what it is; the rate is the file's own, once connected.

    Raises:
        PerceptionConfigError: the rig names no camera or no file.
    """

    def __init__(
        self, *, rig: Rig, scenario: Scenario | None = None, arm: ArmConfig | None = None, bus: "Bus | None" = None
    ) -> None:
        del scenario, arm, bus  # every source is made from the same parts; this one needs its file alone
        named, self.spec = named_camera(rig)
        self._path = Path(named.device)
        self._video: Any = None
        self._first_ns: int | None = None
        self._n_grabbed = 0

    def connect(self) -> None:
        """Open the file, at its beginning.

        Raises:
            PerceptionConfigError: there is no such file, it is no video, or not of the calibrated size.
        """
        self.close()
        if not self._path.is_file():
            raise PerceptionConfigError(
                f"camera {self.spec.name}: expected a video file, there is none at {self._path}"
            )
        cv2 = opencv()
        video = cv2.VideoCapture(str(self._path))
        rate_hz = float(video.get(cv2.CAP_PROP_FPS)) if video.isOpened() else 0.0
        size = int(video.get(cv2.CAP_PROP_FRAME_WIDTH)), int(video.get(cv2.CAP_PROP_FRAME_HEIGHT))
        if not LEAST_HZ <= rate_hz <= MOST_HZ or size != (self.spec.width_px, self.spec.height_px):
            video.release()
            raise PerceptionConfigError(
                f"camera {self.spec.name}: expected a video of {self.spec.width_px} × {self.spec.height_px} pixels as "
                f"calibrated, {LEAST_HZ:g} to {MOST_HZ:g} a second, {self._path} has {size[0]} × {size[1]}, {rate_hz:g}"
            )
        self.spec = msgspec.structs.replace(self.spec, rate_hz=rate_hz)
        self._video, self._first_ns, self._n_grabbed = video, None, 0

    def read(self, now_ns: int) -> Frame | None:
        """Return the newest frame due by now that was not returned before, or None.

        Raises:
            WireError: not connected.
        """
        if self._video is None:
            raise WireError(f"camera {self.spec.name}: not connected")
        if self._first_ns is None:
            self._first_ns = now_ns
        due = int((now_ns - self._first_ns) * self.spec.rate_hz / NS)
        is_there = False
        while self._n_grabbed <= due:
            is_there = self._video.grab()
            if not is_there:
                return None
            self._n_grabbed += 1
        if not is_there:
            return None
        is_there, picture = self._video.retrieve()
        if not is_there:
            return None
        cv2 = opencv()
        stamp_ns = self._first_ns + round(due * NS / self.spec.rate_hz)
        return frame_of(
            cv2.cvtColor(picture, cv2.COLOR_BGR2RGB), camera=self.spec.name, sequence=due, stamp_ns=stamp_ns,
            arrival_ns=now_ns,
        )  # fmt: skip

    def close(self) -> None:
        """Let go of the file. Idempotent."""
        if self._video is not None:
            self._video.release()
            self._video = None
