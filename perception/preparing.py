"""A camera's files made of what a photographer takes: boards for its lens and place, a guided sample for colours."""

from config.resolved import Resolved
from perception.calibrated import calibrated, printed
from perception.calibration.board import Board
from perception.calibration.camera_file import CameraFile
from perception.detection import ColourFile, learn_colours
from perception.detection.regions import Region
from robot.photographs import Photographer
from robot.rigs import load

__all__ = ["STUDIO", "learnt", "prepared"]

STUDIO = "sim_twin.studio:open_studio"
"""Who takes the pictures, by name: neither room knows the other."""
SHARPNESS = 1.5


def prepared(resolved: Resolved, *, camera: str, date: str) -> tuple[CameraFile, ColourFile]:
    """Return the file of one of the studio's cameras, and how a scenario's things look through it.

    Raises:
        CalibrationRefusedError: what was taken is not good enough.
        RobotConfigError: there is no such camera, or nothing here can draw.
    """
    studio: Photographer = load(STUDIO)(resolved, sharpness=SHARPNESS, camera=camera)
    board = Board()
    try:
        file = calibrated(board, studio.boards(printed(board)), resolved.scenario, date=date)
        return file, learnt(studio, file, resolved)
    finally:
        studio.close()


def learnt(studio: Photographer, camera: CameraFile, resolved: Resolved) -> ColourFile:
    """Return the colours of a studio's guided sample."""
    sample = studio.sample()
    frames = {str(number): photograph.frame for number, (photograph, _) in enumerate(sample)}
    regions = [
        Region.named(image=str(number), region=region) for number, (_, named) in enumerate(sample) for region in named
    ]
    return learn_colours(frames, regions, camera=camera, scenario=resolved.scenario)
