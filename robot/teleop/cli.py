"""`autotelic teleop`: drive an arm by hand, which it does without a sub-command; `check` shows that the limits hold."""

from pathlib import Path
from typing import Annotated

import msgspec
import typer
from rich.console import Console

from config.loader import resolve
from config.resolved import Resolved
from robot.errors import RobotConfigError
from robot.rigs import load
from robot.stdio import STDERR, redirected_stdout
from robot.teleop.wanted import Answer, Wanted

__all__ = ["CHECKERS", "IN_SHADOW", "PROBERS", "app"]

IN_SHADOW = "sim_twin.checking.shadowed:check_in_shadow"
CHECKERS = {"twin": "sim_twin.checking:check_rig", "virtual": IN_SHADOW, "real": IN_SHADOW}
"""Who checks a rig, by the kind of its plant. An arm on a wire is only looked at: streams end at a shadow's gate."""
PROBERS = {"virtual": "robot.teleop.probe:probe_rig", "real": "robot.teleop.probe:probe_rig"}
"""Who moves an arm on a wire by the probe list, a person attending."""
ALONE = ("full", "mutate", "stream", "commands", "blocks", "workers", "seed")
"""What says nothing of a probe list, which is always the same."""

app = typer.Typer(
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    help="Drive an arm by keyboard, gamepad, SpaceMouse or script, safety-limited.",
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
    record_to: Annotated[Path | None, typer.Option(help="Record the drive to this MCAP file.")] = None,
    person: Annotated[str, typer.Option(help="Who drives, as they want to be called in what is recorded.")] = "unnamed",
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
            json=json, record_to=record_to, person=person,
        )
    )  # fmt: skip


@app.command()
def check(
    *,
    context: typer.Context,
    rig: Annotated[
        str, typer.Option(help="Which rig. An arm on a wire is only watched: streams go to a shadow of it.")
    ] = "twin",
    scenario: Annotated[str, typer.Option(help="Which table.")] = "paper",
    profile: Annotated[str | None, typer.Option(help="Limits in place of those that the rig names.")] = None,
    full: Annotated[bool, typer.Option("--full", help="All streams, not a seeded tenth.")] = False,
    probe: Annotated[
        bool, typer.Option("--probe", help="Arm on a wire: move it by a short, slow list, a person attending.")
    ] = False,
    mutate: Annotated[bool, typer.Option("--mutate", help="Weaken each limit alone by 5 %; all must be told.")] = False,
    stream: Annotated[int | None, typer.Option(min=0, help="One stream alone, by its number.")] = None,
    seed: Annotated[int, typer.Option(min=0, help="Of all that is drawn.")] = 0,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for report, figure and what has been run: the same command goes on there."),
    ] = None,
    commands: Annotated[int | None, typer.Option(min=1, max=2000, help="Commands a stream.")] = None,
    blocks: Annotated[int | None, typer.Option(min=1, help="So many blocks of streams only.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, max=64, help="Processes.")] = None,
) -> None:
    """Send hostile and human-like streams through a rig's stack; exit code 1 if the physics broke a limit.

    An arm on a wire (virtual_lab, lab) stays disarmed and is only watched; with --probe it is armed and moved a little.
    """
    if probe:
        _require_alone(context)
    resolved = _with_profile(resolve(rig=rig, scenario=scenario), profile)
    wanted = Wanted(
        seed=seed, full=full, json=json, out=out, stream=stream, mutate=mutate, n_commands=commands, n_blocks=blocks,
        n_workers=workers, probe=probe,
    )  # fmt: skip
    checker = load(_checker(resolved, PROBERS if probe else CHECKERS))
    try:
        with redirected_stdout(STDERR):
            answer: Answer = checker(resolved, wanted)
    except KeyboardInterrupt:
        then = "begins again" if out is None else "goes on where this one was"
        typer.echo(f"interrupted: nothing was decided, nothing is held any more; the same command {then}", err=True)
        raise typer.Exit(1) from None
    if json:
        typer.echo(answer.json)
    else:
        console = Console()
        for part in answer.shown:
            console.print(part)
    if not answer.is_passed:
        raise typer.Exit(1)


def _with_profile(resolved: Resolved, profile: str | None) -> Resolved:
    if profile is None:
        return resolved
    known = [p.name for p in resolved.limits.profiles]
    if profile not in known:
        raise typer.BadParameter(f"expected one of {', '.join(known)}, got {profile}", param_hint="--profile")
    return msgspec.structs.replace(resolved, rig=msgspec.structs.replace(resolved.rig, profile=profile))


def _require_alone(context: typer.Context) -> None:
    """Refuse options beside --probe that choose among streams."""
    sources = {name: context.get_parameter_source(name) for name in ALONE}
    given = [name for name, source in sources.items() if source is not None and source.name == "COMMANDLINE"]
    if given:
        raise typer.BadParameter(
            f"expected no --{given[0]} beside it: its list is always the same", param_hint="--probe"
        )


def _checker(resolved: Resolved, known: dict[str, str]) -> str:
    """Return who checks this rig.

    Raises:
        RobotConfigError: nobody does: nothing was connected to.
    """
    kind, name = resolved.rig.expected.kind, resolved.rig.name
    if kind in known:
        return known[kind]
    raise RobotConfigError(
        f"rig {name}: expected a plant of kind {' or '.join(known)}, it is {kind}. Nothing was connected to, nothing "
        "moves"
    )
