"""Who may look at every frame that is read of a camera. Nothing that it does comes back."""

from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

from robot.frames import CameraSpec, Frame
from robot.hal.protocols import Camera

__all__ = ["FrameTap", "TappedCamera", "tapped"]


@runtime_checkable
class FrameTap(Protocol):
    """Told of each frame, by whoever reads it; never raises, never waits."""

    def seen(self, frame: Frame) -> None:
        """Take note of a frame."""
        ...


class TappedCamera:
    """Implements robot.hal.protocols.Camera around another camera.

    Args:
        camera: what is looked at.
        tell: is told each frame that is read.
    """

    def __init__(self, camera: Camera, tell: Callable[[Frame], object]) -> None:
        self._camera, self._tell = camera, tell

    @property
    def spec(self) -> CameraSpec:
        """What it is."""
        return self._camera.spec

    def connect(self) -> None:
        """Acquire the camera."""
        self._camera.connect()

    def read(self, now_ns: int) -> Frame | None:
        """Return the newest frame, and tell it."""
        frame = self._camera.read(now_ns)
        if frame is not None:
            self._tell(frame)
        return frame

    def close(self) -> None:
        """Release the camera. Idempotent, never raises."""
        self._camera.close()


def tapped(cameras: Mapping[str, Camera], tap: object) -> Mapping[str, Camera]:
    """Return cameras whose frames a tap is told, where it is one of frames; else the same."""
    if not isinstance(tap, FrameTap):
        return cameras
    return {name: TappedCamera(camera, tap.seen) for name, camera in cameras.items()}
