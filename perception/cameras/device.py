"""A camera on a wire (UVC, by OpenCV and Video4Linux): a thread takes what comes, the newest is read. The edge.

Exposure and white balance are locked: lamps and colours are told by how they look. A frame is stamped by the driver
where that tells the kernel's monotonic time, and by its arrival less half a period where it does not.
"""

import re
from collections.abc import Callable
from pathlib import Path
from threading import Event, Lock, Thread
from time import monotonic_ns
from typing import TYPE_CHECKING, Any, Protocol

import msgspec

from config.arm import ArmConfig
from config.rig import Rig
from config.scenario import Scenario
from perception.cameras.named import named_camera
from perception.errors import PerceptionConfigError
from perception.opencv import opencv
from robot.errors import WireError
from robot.frames import CameraSpec, Frame, Picture, frame_of

if TYPE_CHECKING:
    from robot.bus import Bus

__all__ = ["Capture", "DeviceCamera", "exposed_ns", "open_device"]

MANUAL, BY_ITSELF = 1.0, 3.0
"""Of Video4Linux, how exposure is chosen."""
TICK_NS = 100_000
"""Of Video4Linux, what exposure is counted in."""
OLDEST_NS = 500_000_000
"""A driver's stamp that is older when the frame comes is of another clock."""
END_S = 1.0
SYSTEM = Path("/sys/class/video4linux")


class Capture(Protocol):
    """An opened device."""

    def grab(self) -> tuple[Picture, int] | None:
        """Wait for a frame; return it, with the driver's stamp (0 where it has none), or None where none comes."""
        ...

    def close(self) -> None:
        """Let go of the device."""
        ...


class DeviceCamera:
    """Gives the newest frame of a device (robot.hal.protocols.Camera).

    Args:
        rig: its camera's device is a file such as /dev/video0.
        opens: opens a device as its spec says, and raises WireError where there is none.
        now_ns: the monotonic clock.

    Attributes:
        spec: what it is; the serial is the device's own, once connected.

    Raises:
        PerceptionConfigError: the rig names no camera or no device.
    """

    def __init__(
        self, *, rig: Rig, scenario: Scenario | None = None, arm: ArmConfig | None = None, bus: "Bus | None" = None,
        opens: "Callable[[str, CameraSpec, float | None], Capture] | None" = None,
        now_ns: Callable[[], int] = monotonic_ns,
    ) -> None:  # fmt: skip
        del scenario, arm, bus  # every source is made from the same parts; this one needs its device alone
        named, self.spec = named_camera(rig)
        self._device, self._exposure = named.device, named.exposure
        self._opens, self._now_ns = opens or open_device, now_ns
        self._lock = Lock()
        self._newest: Frame | None = None
        self._why_over: str | None = None
        self._end = Event()
        self._thread: Thread | None = None

    def connect(self) -> None:
        """Take the device, and begin to take frames from it.

        Raises:
            WireError: it is not there, or somebody else's.
            PerceptionConfigError: it does not do what the rig's file asks.
        """
        self.close()
        self.spec = msgspec.structs.replace(self.spec, serial=_serial_of(self._device))
        capture = self._opens(self._device, self.spec, self._exposure)
        self._end, self._why_over, self._newest = Event(), None, None
        self._thread = Thread(target=self._take_all, args=(capture, self._end), name="camera", daemon=True)
        self._thread.start()

    def read(self, now_ns: int) -> Frame | None:
        """Return the newest frame that was not returned before, or None.

        Raises:
            WireError: not connected, or the device gives none any more.
        """
        del now_ns  # what has not arrived is not there
        if self._thread is None:
            raise WireError(f"camera {self.spec.name}: not connected")
        with self._lock:
            frame, self._newest = self._newest, None
            why = self._why_over
        if frame is None and why is not None:
            raise WireError(why)
        return frame

    def close(self) -> None:
        """Let go of the device; one that hangs is let go of when it comes back. Idempotent."""
        self._end.set()
        if self._thread is not None:
            self._thread.join(END_S)
            self._thread = None
        self._newest = None

    def _take_all(self, capture: Capture, end: Event) -> None:
        """Take frames until told to end: the thread that has a device also lets go of it."""
        period_ns, sequence, last_ns = round(1e9 / self.spec.rate_hz), 0, None
        exposure_ns = 0 if self._exposure is None else round(self._exposure * TICK_NS)
        while not end.is_set():
            grabbed = capture.grab()
            now_ns = self._now_ns()
            if end.is_set():
                break
            if grabbed is None:
                with self._lock:
                    self._why_over = f"camera {self.spec.name}: {self._device} gives no frame; is it plugged in?"
                break
            picture, told_ns = grabbed
            stamp_ns = exposed_ns(told_ns, now_ns, period_ns=period_ns, exposure_ns=exposure_ns)
            if last_ns is not None:
                sequence += max(1, round((stamp_ns - last_ns) / period_ns))  # a gap in time is frames that were lost
            last_ns = stamp_ns
            frame = frame_of(picture, camera=self.spec.name, sequence=sequence, stamp_ns=stamp_ns, arrival_ns=now_ns)
            with self._lock:
                self._newest = frame
        capture.close()


def exposed_ns(told_ns: int, now_ns: int, *, period_ns: int, exposure_ns: int) -> int:
    """Return the middle of a frame's exposure.

    Args:
        told_ns: the driver's stamp, of the end of the exposure; 0 where it has none.
        now_ns: when the frame came.
        period_ns: between frames.
        exposure_ns: how long one is exposed; 0 where that is not known.
    """
    is_ours = 0 <= now_ns - told_ns <= OLDEST_NS
    return (told_ns if is_ours else now_ns - period_ns // 2) - exposure_ns // 2


def open_device(device: str, spec: CameraSpec, exposure: float | None) -> Capture:
    """Open a device as its spec says, by OpenCV.

    Raises:
        WireError: it is not there, or somebody else's.
        PerceptionConfigError: it has no pictures of that size, or does not hold the exposure.
    """
    cv2 = opencv()
    capture = cv2.VideoCapture(_number_of(device), cv2.CAP_V4L2)
    if not capture.isOpened():
        raise WireError(f"camera {spec.name}: expected a device at {device}, it cannot be opened: is it plugged in?")
    wanted = {
        cv2.CAP_PROP_FOURCC: cv2.VideoWriter.fourcc(*"MJPG"), cv2.CAP_PROP_FRAME_WIDTH: spec.width_px,
        cv2.CAP_PROP_FRAME_HEIGHT: spec.height_px, cv2.CAP_PROP_FPS: spec.rate_hz, cv2.CAP_PROP_BUFFERSIZE: 1,
        cv2.CAP_PROP_AUTO_WB: 0, cv2.CAP_PROP_AUTO_EXPOSURE: BY_ITSELF if exposure is None else MANUAL,
    }  # fmt: skip
    for key, value in wanted.items():
        capture.set(key, float(value))
    if exposure is not None:
        capture.set(cv2.CAP_PROP_EXPOSURE, exposure)
    came = [float(capture.get(key)) for key in (cv2.CAP_PROP_FRAME_WIDTH, cv2.CAP_PROP_FRAME_HEIGHT)]
    held = exposure if exposure is None else float(capture.get(cv2.CAP_PROP_EXPOSURE))
    if came != [spec.width_px, spec.height_px] or held != exposure:
        capture.release()
        raise PerceptionConfigError(
            f"camera {spec.name}: expected {spec.width_px} × {spec.height_px} pixels and exposure {exposure}, "
            f"{device} has {came[0]:g} × {came[1]:g} and {held}"
        )
    return _OpenCvCapture(capture, cv2)


class _OpenCvCapture:
    def __init__(self, capture: Any, cv2: Any) -> None:  # noqa: ANN401 - OpenCV has no types
        self._capture, self._cv2 = capture, cv2

    def grab(self) -> tuple[Picture, int] | None:
        if not self._capture.grab():
            return None
        told_ns = round(1e6 * float(self._capture.get(self._cv2.CAP_PROP_POS_MSEC)))
        is_there, picture = self._capture.retrieve()
        return (self._cv2.cvtColor(picture, self._cv2.COLOR_BGR2RGB), told_ns) if is_there else None

    def close(self) -> None:
        self._capture.release()


def _number_of(device: str) -> int:
    """Return the number of a device such as /dev/video0, or of a link to one.

    Raises:
        WireError: it is none, or not there.
    """
    found = re.fullmatch(r"/dev/video(\d+)", str(Path(device).resolve()))
    if found is None or not Path(device).exists():
        raise WireError(f"expected a camera's device such as /dev/video0, there is none at {device}: is it plugged in?")
    return int(found[1])


def _serial_of(device: str) -> str:
    """Return the serial that a USB camera tells; empty where it tells none."""
    try:
        return (SYSTEM / Path(device).resolve().name / "device" / ".." / "serial").read_text().strip()
    except OSError:
        return ""
