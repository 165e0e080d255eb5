"""A camera's frames as a session keeps them: compressed, as viewers know them. The edge to OpenCV's coder."""

from types import ModuleType

import numpy as np

from config.rig import RigCamera
from robot.errors import RobotConfigError
from robot.frames import Frame, Picture, picture_of
from robot.viewer_messages import CompressedImage, stamp_of

__all__ = ["ImageCoder", "decode_image", "image_coder", "opencv"]

NONE = "none"


class ImageCoder:
    """Compresses frames.

    Args:
        form: jpeg or png.
        quality: of a JPEG, from 1 to 100.

    Raises:
        RobotConfigError: OpenCV is not installed, or knows no such form.
    """

    def __init__(self, form: str, *, quality: int) -> None:
        self._cv2, self._form = opencv(), form
        kinds = {"jpeg": (".jpg", [self._cv2.IMWRITE_JPEG_QUALITY, quality]), "png": (".png", [])}
        if form not in kinds:
            raise RobotConfigError(f"recorded frames: expected {' or '.join(kinds)}, came {form!r}")
        self._suffix, self._how = kinds[form]

    def encode(self, frame: Frame) -> CompressedImage:
        """Return a frame, compressed."""
        _, packed = self._cv2.imencode(self._suffix, picture_of(frame)[:, :, ::-1], self._how)
        return CompressedImage(
            timestamp=stamp_of(frame.stamp_ns), frame_id=frame.camera, data=packed.tobytes(), format=self._form
        )


def image_coder(camera: RigCamera | None) -> ImageCoder | None:
    """Return what compresses the frames of a rig's camera; None where it has none, or they are not to be recorded."""
    if camera is None or camera.recorded == NONE:
        return None
    return ImageCoder(camera.recorded, quality=camera.recorded_quality)


def decode_image(image: CompressedImage) -> Picture | None:
    """Return a recorded picture; None where its bytes are none.  -> (height, width, 3) uint8"""
    cv2 = opencv()
    found = cv2.imdecode(np.frombuffer(image.data, np.uint8), cv2.IMREAD_COLOR) if image.data else None
    return None if found is None else np.ascontiguousarray(found[:, :, ::-1])


def opencv() -> ModuleType:
    """Return the module, with one thread: what runs here shares its processors with a control loop.

    Raises:
        RobotConfigError: it is not installed.
    """
    try:
        import cv2
    except ImportError as error:
        raise RobotConfigError(
            f"recorded frames: expected OpenCV, which compresses them, came: {error}. Install the extra that brings "
            "it: pip install 'autotelic[lab]'; or set `recorded: none` for the rig's camera"
        ) from error
    cv2.setNumThreads(1)
    return cv2
