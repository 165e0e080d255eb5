"""OpenCV, imported when it is first needed: it comes with the extra `lab`."""

from types import ModuleType

from perception.errors import OpenCvMissingError

__all__ = ["opencv"]


def opencv() -> ModuleType:
    """Return the module, with one thread: what runs here shares its processors with a control loop.

    Raises:
        OpenCvMissingError: it is not installed.
    """
    try:
        import cv2
    except ImportError as error:
        raise OpenCvMissingError(
            f"expected OpenCV, which finds and calibrates by boards, came: {error}. Install the extra that brings it: "
            "pip install 'autotelic[lab]'"
        ) from error
    cv2.setNumThreads(1)
    return cv2
