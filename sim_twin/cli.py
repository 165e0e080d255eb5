"""`autotelic twin`: look at the simulated table."""

import os
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from typer import Typer

from config.errors import ConfigError

__all__ = ["app"]

app = Typer(no_args_is_help=True, help="Look at the simulated table: a picture, or its model as MJCF.")

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
) -> None:
    """Draw one table to a PNG file (needs EGL or OSMesa)."""
    os.environ.setdefault("MUJOCO_GL", "egl")
    from matplotlib.image import imsave

    from sim_twin.render import NoGLError, open_renderer, render

    plant = _make_plant(scenario, rig)
    plant.resetter.reset(seed=seed, epoch=0, digital_out=_bits(outputs))
    try:
        with open_renderer(plant.world) as renderer:
            imsave(out, render(plant.world, renderer))
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
    from config.loader import load_arm, load_rig, load_scenario
    from sim_twin.scene import build_scene

    try:
        rig_config = load_rig(rig)
        spec = build_scene(
            load_arm(rig_config.arm), load_scenario(scenario), physics_s=rig_config.physics_s, tick_s=rig_config.tick_s
        )
    except ConfigError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(2) from None
    spec.compile()
    out.write_text(spec.to_xml(), encoding="utf-8")
    typer.echo(f"wrote {out}")
