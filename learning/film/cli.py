"""`autotelic film RUN --out run.mp4`: a minute of a run, for people. The edge: terminal and host clock."""

import os
from pathlib import Path
from time import perf_counter
from typing import Annotated

import typer

from learning.errors import LearningError, RunFolderError
from learning.progress import Status
from learning.run_folder import RunFolder

__all__ = ["film"]

EXIT_FAILED, EXIT_USAGE = 1, 2
SUFFIX = ".mp4"


def film(
    run: Annotated[Path, typer.Argument(help="Folder of a run on a twin.")],
    out: Annotated[Path, typer.Option(help="Video to write (.mp4).")] = Path("run.mp4"),
    rate: Annotated[float, typer.Option(min=1.0, max=60.0, help="Pictures a second.")] = 20.0,
) -> None:
    """Film how a run began, what it learnt, what a change of rules broke and how it recovered: a minute, captioned.

    Curves are from the run's metrics; what moves is the run's own epochs, lived again on the twin from its checkpoints
    and held to its tables, and tests with learning off. Needs OpenCV and a GL to draw with (MUJOCO_GL=egl or osmesa).
    """
    if out.suffix != SUFFIX:
        typer.echo(f"error: {out}: expected a file whose name ends in {SUFFIX}", err=True)
        raise typer.Exit(EXIT_USAGE)
    os.environ.setdefault("MUJOCO_GL", "egl")  # before the physics is imported
    try:
        folder = RunFolder(run)
        folder.manifest()
        from learning.film.filming import film_run  # brings torch and the physics

        with Status(f"filming {run}", now_s=perf_counter) as status:
            seconds = film_run(folder, out, rate_hz=rate, tell=status)
    except LearningError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(EXIT_USAGE if isinstance(error, RunFolderError) else EXIT_FAILED) from error
    typer.echo(f"{out}: {seconds:.0f} s")
