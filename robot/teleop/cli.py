"""`autotelic teleop`: drive an arm by hand; without a sub-command it drives."""

from typing import Annotated

import typer

__all__ = ["app"]

app = typer.Typer(
    invoke_without_command=True, help="Drive an arm by keyboard, gamepad, SpaceMouse or script, safety-limited."
)


@app.callback()
def drive(
    context: typer.Context,
    rig: Annotated[str, typer.Option("--rig", "-r", help="A shipped rig's name or a file.")] = "twin",
    scenario: Annotated[str, typer.Option("--scenario", "-s", help="A shipped scenario's name or a file.")] = "paper",
    device: Annotated[
        str, typer.Option("--device", "-d", help="keyboard, gamepad, spacemouse or script:FILE.")
    ] = "keyboard",
    speed: Annotated[float, typer.Option(min=0.01, max=1.0, help="Share of full speed to begin with.")] = 0.5,
    seed: Annotated[int, typer.Option(min=0, help="Which table is drawn, where a twin lays it out.")] = 0,
    *,
    view: Annotated[bool, typer.Option("--view/--no-view", help="Show the table while driving.")] = True,
    preview: Annotated[
        bool, typer.Option("--preview", help="Try every intent on a shadow twin 200 ms before it is sent.")
    ] = False,
    fast: Annotated[
        bool, typer.Option("--fast", help="Twin and script only: as fast as the processor goes, not in real time.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="Print what the drive came to as one JSON object.")] = False,
) -> None:
    """Drive until you quit. Ctrl-C brings the arm to rest and gives the terminal back (exit code 0)."""
    if context.invoked_subcommand is not None:
        return
    from robot.teleop.drive import DriveOptions, run_drive  # brings MuJoCo, which --help does not need

    run_drive(
        DriveOptions(
            rig=rig, scenario=scenario, device=device, speed=speed, seed=seed, view=view, preview=preview, fast=fast,
            json=json,
        )
    )  # fmt: skip
