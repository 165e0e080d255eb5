"""`autotelic calibrate`: print a board, find a camera's lens and its place, and check them by touch. The edge."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from config.loader import load_arm
from perception.calibration.board import Board
from perception.calibration.board_pdf import BAR_MM, PAPERS_MM, board_pdf
from perception.calibration.camera_file import CameraFile, load_board, load_camera, save
from perception.calibration.evidence import POSES_FILE, TOUCHES_FILE, load_poses, load_touches
from perception.calibration.faults import refuse
from perception.calibration.gates import check_bar
from perception.calibration.plane_error import grid_on_table
from perception.calibration.sighting import Finder, Sighting
from perception.cameras.folder import picture_paths, read_picture
from perception.errors import CalibrationRefusedError, PerceptionConfigError

__all__ = ["app"]

MM_PER_M = 1e3

app = typer.Typer(no_args_is_help=True, help="Boards, lenses and places of cameras (docs/calibration.md).")

CameraOption = Annotated[Path, typer.Option("--camera", help="The camera's file; it is written in place.")]
FolderArgument = Annotated[Path, typer.Argument(help="Folder of pictures.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print what was found as one JSON object.")]


@app.command()
def board(
    out: Annotated[Path, typer.Argument(help="PDF file to write; the board's file is written beside it, as .yaml.")],
    *,
    squares: Annotated[str, typer.Option(metavar="COLUMNSxROWS", help="How many squares.")] = "7x5",
    square_mm: Annotated[float, typer.Option(help="Side of a square.")] = 36.0,
    marker_mm: Annotated[float, typer.Option(help="Side of a marker.")] = 27.0,
    dictionary: Annotated[str, typer.Option(help="Which markers, such as 5X5_100.")] = "5X5_100",
    paper: Annotated[str, typer.Option(help=f"One of {', '.join(PAPERS_MM)}.")] = "a4",
) -> None:
    """Write a ChArUco board to scale, with a bar of 100 mm to measure."""
    if out.suffix != ".pdf" or not out.parent.is_dir():
        raise PerceptionConfigError(f"expected a file .pdf in a folder that exists, came {out}")
    asked = _asked_board(squares, square_mm, marker_mm, dictionary)
    out.write_bytes(board_pdf(asked, paper=paper))
    save(out.with_suffix(".yaml"), asked)
    typer.echo(f"wrote {out} and {out.with_suffix('.yaml')}: print at 100 %, then measure the bar ({BAR_MM:g} mm)")


@app.command()
def intrinsics(
    folder: FolderArgument,
    *,
    board: Annotated[Path, typer.Option("--board", help="The board's file, as `calibrate board` wrote it.")],
    bar_mm: Annotated[float, typer.Option("--bar-mm", help="The printed bar's length by your ruler, in mm.")],
    camera: Annotated[Path, typer.Option("--camera", help="The camera's file to write.")],
    name: Annotated[str, typer.Option(help="What the camera is called.")],
    serial: Annotated[str, typer.Option(help="The camera's serial, as printed on it.")],
    wide: Annotated[bool, typer.Option("--wide", help="A lens of 90 degrees or more: one more coefficient.")] = False,
    json: JsonOption = False,
) -> None:
    """Find a lens from pictures of a board held at many angles all over the frame.

    A picture of the coverage is written beside the camera's file, for a set that is refused too.
    """
    from perception.calibration.coverage import draw_coverage
    from perception.calibration.intrinsics import fit_lens

    printed = load_board(board)
    refuse(check_bar(printed, bar_mm, BAR_MM))
    paths = picture_paths(folder)
    seen = _sightings(printed, folder, [path.name for path in paths])
    coverage = camera.with_suffix(".coverage.png")
    draw_coverage(coverage, printed, seen)
    typer.echo(f"wrote {coverage}", err=True)
    lens, record = fit_lens(printed, seen, date=_today(), with_k3=wide)
    found = CameraFile(name=name, serial=serial, board=printed, lens=lens, intrinsics=record)
    save(camera, msgspec.convert(msgspec.to_builtins(found), CameraFile))
    _tell(
        found, is_json=json,
        text=f"wrote {camera}: {len(record.views)} views, {record.rms_px:.2f} px rms, focal length {lens.fx_px:.1f} "
        f"and {lens.fy_px:.1f} px ± {record.focal_sd_px:.1f}, centre {lens.cx_px:.1f}, {lens.cy_px:.1f} ± "
        f"{record.centre_sd_px:.1f}",
    )  # fmt: skip


@app.command()
def extrinsics(
    folder: FolderArgument,
    *,
    camera: CameraOption,
    arm: Annotated[str, typer.Option(help="Arm whose workspace errors are told for.")] = "ur5e",
    table_mm: Annotated[float, typer.Option("--table-mm", help="Height of the table in the base frame.")] = 0.0,
    json: JsonOption = False,
) -> None:
    """Find where a camera stands, by touches.yaml (boards lying still) or poses.yaml (one in the hand)."""
    from perception.calibration.extrinsics import fit_carried, fit_table

    known = load_camera(camera)
    low, high = load_arm(arm).motion.workspace_m
    area = grid_on_table(low, high, table_mm / MM_PER_M)
    if _is_carried(folder):
        poses = load_poses(folder)
        seen = _sightings(known.board, folder, [view.image for view in poses.views])
        record = fit_carried(known, poses, seen, area, date=_today())
    else:
        touches = load_touches(folder)
        seen = _sightings(known.board, folder, [image for p in touches.placements for image in p.images])
        record = fit_table(known, touches, seen, area, date=_today())
    found = msgspec.structs.replace(known, extrinsics=record, verified=None)
    save(camera, found)
    place = ", ".join(f"{value:.4f}" for value in record.pose.position_m)
    _tell(
        found, is_json=json,
        text=f"wrote {camera}: at {place} m by {record.method}, {record.rms_px:.2f} px rms over {len(record.views)} "
        f"views, expected on the table {record.expected_mm:.2f} mm; now check it by touch: calibrate verify",
    )  # fmt: skip


@app.command()
def verify(folder: FolderArgument, *, camera: CameraOption, json: JsonOption = False) -> None:
    """Check a camera by touched corners of boards that lie where none lay for the fit. Exit code 1 if it is off."""
    from perception.calibration.verify import MOST_MEAN_MM, MOST_P95_MM
    from perception.calibration.verify import verify as verify_touches

    known, touches = load_camera(camera), load_touches(folder)
    seen = _sightings(known.board, folder, [image for p in touches.placements for image in p.images])
    checked = verify_touches(known, touches, seen, date=_today())
    is_good = checked.mean_mm <= MOST_MEAN_MM and checked.p95_mm <= MOST_P95_MM
    found = msgspec.structs.replace(known, verified=checked if is_good else None)
    save(camera, found)
    text = (
        f"{checked.n_points} points: mean {checked.mean_mm:.2f} mm (≤ {MOST_MEAN_MM:g}), p95 {checked.p95_mm:.2f} mm "
        f"(≤ {MOST_P95_MM:g}), most {checked.max_mm:.2f} mm"
    )
    _tell(msgspec.to_builtins(checked) | {"ok": is_good}, is_json=json, text=text)
    if not is_good:
        raise CalibrationRefusedError(f"{text}: the camera is off; was it moved? Run `calibrate extrinsics` again")


def _asked_board(squares: str, square_mm: float, marker_mm: float, dictionary: str) -> Board:
    """Return the board that options ask for, held to the ranges of its file."""
    try:
        columns, rows = (int(part) for part in squares.lower().split("x"))
    except ValueError:
        raise PerceptionConfigError(f"expected squares such as 7x5, came {squares!r}") from None
    asked = {
        "n_columns": columns, "n_rows": rows, "square_m": square_mm / MM_PER_M, "marker_m": marker_mm / MM_PER_M,
        "dictionary": dictionary,
    }  # fmt: skip
    try:
        return msgspec.convert(asked, Board)
    except msgspec.ValidationError as error:
        raise PerceptionConfigError(f"expected a board that can be printed: {error}") from error


def _is_carried(folder: Path) -> bool:
    """Whether the folder tells of a board in the hand.

    Raises:
        PerceptionConfigError: neither file is there, or both are.
    """
    has_touches, has_poses = (folder / TOUCHES_FILE).is_file(), (folder / POSES_FILE).is_file()
    if has_touches == has_poses:
        came = "both" if has_touches else "neither"
        raise PerceptionConfigError(f"{folder}: expected {TOUCHES_FILE} or {POSES_FILE}, {came} is there")
    return has_poses


def _sightings(board: Board, folder: Path, images: list[str]) -> list[Sighting]:
    """Return what is seen of a board in pictures of a folder, each looked at once."""
    finder = Finder(board)
    return [finder.find(read_picture(folder / image), image) for image in dict.fromkeys(images)]


def _today() -> str:
    return datetime.now(UTC).date().isoformat()


def _tell(found: object, *, is_json: bool, text: str) -> None:
    typer.echo(msgspec.json.encode(found).decode() if is_json else text)
