"""A folder of pictures as a camera: each file is a frame, in the order of their names."""

from pathlib import Path

from perception.errors import PerceptionConfigError
from perception.opencv import opencv
from robot.errors import WireError
from robot.frames import CameraSpec, Frame, Picture, frame_of

__all__ = ["SUFFIXES", "FolderCamera", "picture_paths", "read_picture", "write_picture"]

SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")
NS = 1e9


def picture_paths(folder: Path) -> list[Path]:
    """Return the pictures of a folder by name.

    Raises:
        PerceptionConfigError: no folder, or no picture in it.
    """
    if not folder.is_dir():
        raise PerceptionConfigError(f"expected a folder of pictures, came {folder}")
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() in SUFFIXES)
    if not paths:
        raise PerceptionConfigError(f"{folder}: expected pictures ({', '.join(SUFFIXES)}), there are none")
    return paths


def read_picture(path: Path) -> Picture:
    """Return a picture file as red, green, blue.

    Raises:
        PerceptionConfigError: it cannot be read as a picture.
    """
    cv2 = opencv()
    picture = cv2.imread(str(path), cv2.IMREAD_COLOR)
    if picture is None:
        raise PerceptionConfigError(f"{path}: expected a picture, came what OpenCV cannot read")
    return cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)


def write_picture(path: Path, picture: Picture) -> None:
    """Write a picture file.

    Raises:
        PerceptionConfigError: it cannot be written there.
    """
    cv2 = opencv()
    if not cv2.imwrite(str(path), cv2.cvtColor(picture, cv2.COLOR_RGB2BGR)):
        raise PerceptionConfigError(f"{path}: expected a place to write a picture to")


class FolderCamera:
    """Gives the pictures of a folder at an even rate, each once, the first at the first read.

    Frames that were due between two reads and are not the newest are passed over, as a live camera's are: the sequence
    number tells. After the last picture nothing more comes.

    Args:
        folder: Where the pictures are.
        name: What the camera is called.
        serial: Serial of the camera that took them; empty where it is not known.
        rate_hz: How fast they come.
    """

    def __init__(self, folder: Path, *, name: str, serial: str = "", rate_hz: float = 30.0) -> None:
        if not rate_hz > 0.0:
            raise PerceptionConfigError(f"camera {name}: expected a rate above 0 Hz, came {rate_hz}")
        self._paths = picture_paths(folder)
        height, width, _ = read_picture(self._paths[0]).shape
        self.spec = CameraSpec(name=name, serial=serial, width_px=width, height_px=height, rate_hz=rate_hz)
        self._is_open = False
        self._first_ns: int | None = None
        self._next = 0

    def connect(self) -> None:
        """Begin with the first picture."""
        self._is_open, self._first_ns, self._next = True, None, 0

    def read(self, now_ns: int) -> Frame | None:
        """Return the newest picture due by now that was not returned before, or None.

        Raises:
            WireError: not connected.
            PerceptionConfigError: a file that is no picture, or one of another size than the first.
        """
        if not self._is_open:
            raise WireError(f"camera {self.spec.name}: not connected")
        if self._first_ns is None:
            self._first_ns = now_ns
        due = min(int((now_ns - self._first_ns) * self.spec.rate_hz / NS), len(self._paths) - 1)
        if due < self._next:
            return None
        self._next = due + 1
        stamp_ns = self._first_ns + round(due * NS / self.spec.rate_hz)
        return frame_of(self._picture(due), camera=self.spec.name, sequence=due, stamp_ns=stamp_ns, arrival_ns=stamp_ns)

    def close(self) -> None:
        """Give up the folder."""
        self._is_open = False

    def _picture(self, index: int) -> Picture:
        picture = read_picture(self._paths[index])
        height, width, _ = picture.shape
        if (width, height) != (self.spec.width_px, self.spec.height_px):
            raise PerceptionConfigError(
                f"{self._paths[index]}: expected {self.spec.width_px} × {self.spec.height_px} pixels as in the first "
                f"picture, came {width} × {height}"
            )
        return picture
