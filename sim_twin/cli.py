"""`autotelic twin`: look at the simulated table, and fit it to an arm."""

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer import Typer

from config.errors import ConfigError
from sim_twin.fitting.command import fit
from sim_twin.shadowing.command import shadow

if TYPE_CHECKING:
    from sim_twin.plant import TwinPlant

__all__ = ["app"]

N_OUTPUTS = 16

app = Typer(no_args_is_help=True, help="Look at the simulated table, fit the twin to an arm, or let it follow one.")

app.command()(fit)
app.command()(shadow)

ScenarioOption = Annotated[str, typer.Option("--scenario", "-s", help="A shipped scenario's name or a file.")]
RigOption = Annotated[str, typer.Option("--rig", "-r", help="A shipped rig's name or a file.")]
SeedOption = Annotated[int, typer.Option("--seed", min=0, help="Which table is drawn.")]


@app.command()
def picture(
    out: Annotated[Path, typer.Argument(help="PNG file to write.")],
    *,
    scenario: ScenarioOption = "paper",
    rig: RigOption = "twin",
    seed: SeedOption = 0,
    outputs: Annotated[
        str, typer.Option("--outputs", help="Digital outputs that are on, by number: lamps and lids, e.g. 1,3,5.")
    ] = "",
    look_from: Annotated[
        str,
        typer.Option(
            "--from",
            metavar="BEARING,ELEVATION,DISTANCE",
            help="Where to look from: degrees round from the arm's front to its left, degrees up, metres.",
        ),
    ] = "",
) -> None:
    """Draw one table to a PNG file (needs EGL or OSMesa)."""
    _check_out(out, ".png")
    os.environ.setdefault("MUJOCO_GL", "egl")
    from matplotlib.image import imsave

    from sim_twin.render import NoGLError, Viewpoint, open_renderer, render

    place = _place(look_from)
    viewpoint = Viewpoint(bearing_deg=place[0], elevation_deg=place[1], distance_m=place[2]) if place else None
    plant = _make_plant(scenario, rig)
    plant.resetter.reset(seed=seed, epoch=0, digital_out=_bits(outputs))
    try:
        with open_renderer(plant.world) as renderer:
            imsave(out, render(plant.world, renderer, viewpoint=viewpoint))
    except NoGLError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(1) from None
    typer.echo(f"wrote {out}")


@app.command()
def model(
    out: Annotated[Path, typer.Argument(help="MJCF file to write.")],
    *,
    scenario: ScenarioOption = "paper",
    rig: RigOption = "twin",
) -> None:
    """Write the table's model as MJCF, to open in any MuJoCo viewer."""
    _check_out(out, ".xml")
    from config.loader import resolve
    from sim_twin.scene import build_scene

    try:
        resolved = resolve(rig=rig, scenario=scenario)
    except ConfigError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(2) from None
    times = resolved.rig
    spec = build_scene(resolved.arm, resolved.scenario, physics_s=times.physics_s, tick_s=times.tick_s)
    spec.compile()
    out.write_text(spec.to_xml(), encoding="utf-8")
    typer.echo(f"wrote {out}")


def _make_plant(scenario: str, rig: str) -> "TwinPlant":
    from config.loader import resolve
    from sim_twin.plant import TwinPlant

    try:
        resolved = resolve(rig=rig, scenario=scenario)
    except ConfigError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(2) from None
    return TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)


def _bits(outputs: str) -> int:
    """Return output numbers as bits."""
    try:
        numbers = [int(n) for n in outputs.split(",") if n.strip()]
    except ValueError:
        numbers = [-1]
    if not all(0 <= n < N_OUTPUTS for n in numbers):
        raise typer.BadParameter(f"expected numbers 0..{N_OUTPUTS - 1} with commas, got {outputs!r}")
    return sum(1 << n for n in set(numbers))


def _place(look_from: str) -> tuple[float, float, float] | None:
    """Return bearing and elevation in degrees and distance in metres; None where nothing is asked."""
    if not look_from:
        return None
    try:
        bearing_deg, elevation_deg, distance_m = (float(part) for part in look_from.split(","))
    except ValueError:
        bearing_deg = elevation_deg = distance_m = math.nan
    if not (math.isfinite(bearing_deg) and 0.0 <= elevation_deg <= 90.0 and 0.5 <= distance_m <= 5.0):
        raise typer.BadParameter(
            f"expected a bearing, an elevation of 0 to 90 degrees and a distance of 0.5 to 5 m, with commas, got "
            f"{look_from!r}",
            param_hint="--from",
        )
    return bearing_deg, elevation_deg, distance_m


def _check_out(path: Path, suffix: str) -> None:
    """Refuse a file that cannot be written, in one line, before anything is made."""
    if path.suffix != suffix or not path.parent.is_dir():
        typer.echo(f"error: expected a file {suffix} in a folder that exists, came {path}", err=True)
        raise typer.Exit(2)
