"""`autotelic perception`: prepare a twin's camera, learn colours from a guided sample, show what is seen. The edge."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from config.loader import resolve
from perception.calibration.camera_file import load_camera, save
from perception.cameras.folder import picture_paths, read_picture, write_picture
from perception.detection import learn_colours
from perception.detection.colour_file import save_colours
from perception.detection.regions import load_regions
from perception.errors import PerceptionConfigError
from perception.preparing import prepared
from perception.showing import shown_tables
from robot.frames import frame_of

__all__ = ["app"]

app = typer.Typer(no_args_is_help=True, help="What a camera makes of the table (docs/perception.md).")

ScenarioOption = Annotated[str, typer.Option(help="Shipped scenario or a file.")]
ColoursOption = Annotated[Path, typer.Option(help="The colours' file to write.")]


@app.command()
def prepare(
    camera: Annotated[str, typer.Argument(help="Which of the twin's cameras.")],
    *,
    calibration: Annotated[Path, typer.Option(help="The camera's file to write.")],
    colours: ColoursOption,
    scenario: ScenarioOption = "paper",
) -> None:
    """Calibrate a twin's camera by pictures of a printed board, and learn colours from pictures that were named."""
    today = datetime.now(tz=UTC).date().isoformat()
    file, learnt = prepared(resolve(scenario=scenario), camera=camera, date=today)
    save(calibration, file)
    save_colours(colours, learnt)
    placed = file.extrinsics
    assert placed is not None, "what was calibrated on the table has a place"
    typer.echo(
        f"wrote {calibration} ({file.intrinsics.rms_px:.2f} px rms, {placed.expected_mm:.2f} mm expected on the table) "
        f"and {colours} ({len(learnt.models)} colours, {len(learnt.lamps)} lamps)"
    )


@app.command()
def show(
    out: Annotated[Path, typer.Argument(help="Folder to write pictures to.")],
    *,
    rig: Annotated[str, typer.Option(help="Shipped rig with a camera, or a file.")] = "twin_camera",
    scenario: ScenarioOption = "paper",
    seed: Annotated[int, typer.Option(min=0, help="Of the tables.")] = 0,
    tables: Annotated[int, typer.Option(min=1, help="How many tables are laid out.")] = 4,
    pictures: Annotated[
        int, typer.Option(min=1, help="How many pictures are looked at of each; the last is drawn.")
    ] = 4,
) -> None:
    """Draw what is made of pictures into them: outlines, distances, ages and, on a twin, how far off each thing is."""
    out.mkdir(parents=True, exist_ok=True)
    resolved = resolve(rig=rig, scenario=scenario)
    for number, (picture, percept) in enumerate(
        shown_tables(resolved, seed=seed, n_tables=tables, n_pictures=pictures)
    ):
        path = out / f"table-{number:03}.png"
        write_picture(path, picture)
        n_known = sum(thing.is_valid for thing in percept.objects)
        typer.echo(f"{path}: {n_known} of {len(percept.objects)} things known")


@app.command()
def learn(
    folder: Annotated[Path, typer.Argument(help="Folder of pictures and regions.yaml.")],
    *,
    camera: Annotated[Path, typer.Option(help="The camera's file.")],
    colours: ColoursOption,
    scenario: ScenarioOption = "paper",
) -> None:
    """Learn how a scenario's things look from pictures in which a person has named regions."""
    file, named = load_camera(camera), load_regions(folder).regions
    by_name = {path.name: path for path in picture_paths(folder)}
    missing = sorted({region.image for region in named} - by_name.keys())
    if missing:
        raise PerceptionConfigError(f"{folder}: expected the pictures that regions.yaml names, {missing} are not there")
    frames = {
        name: frame_of(read_picture(by_name[name]), camera=file.name, sequence=0, stamp_ns=0, arrival_ns=0)
        for name in sorted({region.image for region in named})
    }
    learnt = learn_colours(frames, named, camera=file, scenario=resolve(scenario=scenario).scenario)
    save_colours(colours, learnt)
    typer.echo(f"wrote {colours}: {len(learnt.models)} colours, {len(learnt.lamps)} lamps")
