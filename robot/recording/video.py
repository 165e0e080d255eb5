"""Pictures become a video. The edge to OpenCV's writer."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from robot.frames import Picture
from robot.recording.errors import UnfitError
from robot.recording.images import opencv

__all__ = ["write_video"]


def write_video(out: Path, pictures: Iterable[Picture], *, rate_hz: float) -> int:
    """Write pictures of one size, (h, w, 3) uint8 in red, green and blue, as a video; return how many there were.

    Raises:
        UnfitError: the place or the name is none for a video.
        RobotConfigError: OpenCV is not installed.
    """
    cv2 = opencv()
    out.parent.mkdir(parents=True, exist_ok=True)
    writer, n_written = None, 0
    try:
        for picture in pictures:
            if writer is None:
                height, width = picture.shape[:2]
                writer = cv2.VideoWriter(str(out), cv2.VideoWriter.fourcc(*"mp4v"), rate_hz, (width, height))
                if not writer.isOpened():
                    raise UnfitError(f"{out}: expected a place and a name that ends in .mp4 to write a video to")
            writer.write(np.ascontiguousarray(picture[:, :, ::-1]))
            n_written += 1
    finally:
        if writer is not None:
            writer.release()
    return n_written
