"""One camera's picture with when it was taken: the measurement that perception begins with."""

import numpy as np
from numpy.typing import NDArray

from robot.errors import RobotConfigError
from robot.messages import Message

__all__ = ["N_CHANNELS", "CameraSpec", "Frame", "Picture", "frame_of", "picture_of"]

Picture = NDArray[np.uint8]
"""(height, width, 3) red, green, blue; row 0 is the upper one."""
N_CHANNELS = 3


class CameraSpec(Message, frozen=True, kw_only=True):
    """What can be known of a camera before connecting to it."""

    name: str
    serial: str
    width_px: int
    height_px: int
    rate_hz: float


class Frame(Message, frozen=True, kw_only=True):
    """One picture. Times are nanoseconds of the clock that the camera was asked by."""

    camera: str
    sequence: int
    """Counts what the camera took, from 0; a gap is a frame that was lost."""
    stamp_ns: int
    """Middle of the exposure: when the world looked like this."""
    arrival_ns: int
    """When the frame could be had."""
    width_px: int
    height_px: int
    pixels: bytes
    """Rows from the top, pixels from the left, red, green, blue."""


def frame_of(picture: Picture, *, camera: str, sequence: int, stamp_ns: int, arrival_ns: int) -> Frame:
    """Return a picture as a frame.

    Raises:
        RobotConfigError: not (height, width, 3) of bytes.
    """
    if picture.ndim != N_CHANNELS or picture.shape[2] != N_CHANNELS or picture.dtype != np.uint8:
        raise RobotConfigError(f"expected a picture of (height, width, 3) bytes, came {picture.shape} {picture.dtype}")
    height, width, _ = picture.shape
    return Frame(
        camera=camera,
        sequence=sequence,
        stamp_ns=stamp_ns,
        arrival_ns=arrival_ns,
        width_px=width,
        height_px=height,
        pixels=picture.tobytes(),
    )


def picture_of(frame: Frame) -> Picture:
    """Return a frame's pixels as an array that cannot be written to.  -> (height, width, 3) uint8

    Raises:
        RobotConfigError: more or fewer bytes than its size says.
    """
    expected = frame.width_px * frame.height_px * N_CHANNELS
    if len(frame.pixels) != expected:
        raise RobotConfigError(
            f"camera {frame.camera}, frame {frame.sequence}: expected {expected} bytes for {frame.width_px} × "
            f"{frame.height_px}, came {len(frame.pixels)}"
        )
    return np.frombuffer(frame.pixels, np.uint8).reshape(frame.height_px, frame.width_px, N_CHANNELS)
