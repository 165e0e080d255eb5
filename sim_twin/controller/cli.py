"""`autotelic controller`: a virtual UR controller on a loopback address, and faults for one that runs."""

from pathlib import Path
from typing import Annotated

import typer
from typer import Typer

__all__ = ["app"]

app = Typer(help="A virtual UR controller in front of the twin; unmodified clients connect to it.")
HostOption = Annotated[str, typer.Option("--host", help="Address to listen on; every robot needs its own.")]


@app.callback(invoke_without_command=True)
def controller(
    context: typer.Context,
    *,
    host: HostOption = "127.0.0.2",
    allow_any: Annotated[bool, typer.Option("--allow-any", help="Listen on an address that others can reach.")] = False,
    version: Annotated[str, typer.Option("--version", help="PolyScope version that is announced.")] = "5.11.0",
    scenario: Annotated[str, typer.Option("--scenario", "-s", help="A shipped scenario's name or a file.")] = "paper",
    seed: Annotated[int, typer.Option("--seed", min=0, help="Which table is drawn.")] = 0,
    powered: Annotated[bool, typer.Option("--powered/--unpowered", help="Begin with power on.")] = True,
    bus: Annotated[
        str, typer.Option("--bus", help="Zenoh endpoint for truth and resets, e.g. tcp/127.0.0.2:7447.")
    ] = "",
    keys: Annotated[str, typer.Option("--keys", help="Folder of certificates, for a bus at tls/HOST:PORT.")] = "",
    cell: Annotated[
        str, typer.Option("--cell", help="How the table is wired to the control box: a shipped cell's name or a file.")
    ] = "ur_box",
    plane: Annotated[
        list[str] | None,
        typer.Option(
            "--plane", help="Safety plane nx,ny,nz,offset (base frame, metres): the tool stays on the normal's side."
        ),
    ] = None,
    safety_input: Annotated[
        list[str] | None,
        typer.Option(
            "--safety-input",
            help="Safety function at a pair of terminals, e.g. system_estop=CI0; `fault HOST terminal` opens it.",
        ),
    ] = None,
    script: Annotated[Path | None, typer.Option("--script", help="URScript file to run at the start.")] = None,
    program: Annotated[
        list[Path] | None,
        typer.Option("--program", help="URScript file that the dashboard can load by its name; as many as you like."),
    ] = None,
) -> None:
    """Run a virtual UR controller until Ctrl-C; unmodified clients connect to it."""
    if context.invoked_subcommand is not None:
        return
    from config.errors import ConfigError
    from robot.errors import RobotError
    from robot.realtime import take_priority
    from sim_twin.controller.planes import parse_plane
    from sim_twin.controller.safety_terminals import parse_safety_input
    from sim_twin.controller.server import PRIORITY, ControllerServer, Setup

    try:
        text = "" if script is None else _program_of(script, is_powered=powered)
        setup = Setup(
            host=host,
            version=version,
            scenario=scenario,
            seed=seed,
            is_powered=powered,
            is_any_host_allowed=allow_any,
            script=text,
            shelf=_once("--program", [(path.name, _program_of(path)) for path in program or []]),
            bus=bus,
            keys=keys,
            cell=cell,
            planes=tuple(map(parse_plane, plane or [])),
            safety_inputs=_once("--safety-input", [parse_safety_input(text) for text in safety_input or []]),
        )
        server = ControllerServer(setup, told=lambda words: typer.echo(words, err=True))
        with server:
            take_priority(PRIORITY)
            server.run(when_ready=lambda: typer.echo(f"virtual UR5e {version} ready on {host}"))
    except (OSError, ValueError, ConfigError, RobotError) as error:
        typer.echo(f"error: {' '.join(str(error).split())}", err=True)
        raise typer.Exit(2) from None
    except KeyboardInterrupt:
        typer.echo("stopped")


@app.command()
def fault(
    host: Annotated[str, typer.Argument(help="Address of a running controller.")],
    name: Annotated[str, typer.Argument(help="What to bring about; an unknown name lists them.")],
    numbers: Annotated[list[str] | None, typer.Argument(help="Arguments as name=value, the value in JSON.")] = None,
) -> None:
    """Bring a fault about at a running controller, e.g. `fault 127.0.0.2 delay ms=20`."""
    import msgspec

    from sim_twin.controller.process import ControllerProcessError, ask_fault

    try:
        given = dict(map(_argument, numbers or []))
    except (ValueError, RecursionError) as error:
        typer.echo(f"error: arguments: {error}", err=True)
        raise typer.Exit(2) from None
    try:
        typer.echo(msgspec.json.encode(ask_fault(host, name, **given)).decode())
    except ControllerProcessError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(1) from None


def _program_of(path: Path, *, is_powered: bool = True) -> str:
    """Return a program's text.

    Args:
        path: Its file.
        is_powered: Whether it could run at once.

    Raises:
        ValueError: there is none in the file, or it could not run.
        OSError: it cannot be read.
    """
    if not is_powered:
        raise ValueError(f"{path}: expected a robot with power for --script, got --unpowered: give it as --program")
    try:
        text = path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: expected a program in UTF-8, byte {error.start} is none: save it as text") from error
    if not text.strip():
        raise ValueError(f"{path}: expected a program, the file is empty")
    return text


def _once(option: str, named: list[tuple[str, str]]) -> dict[str, str]:
    """Return what is named, each name once: of two the controller could take one only.

    Raises:
        ValueError: a name comes twice.
    """
    found = dict(named)
    if len(found) < len(named):
        names = [name for name, _ in named]
        twice = next(name for name in names if names.count(name) > 1)
        raise ValueError(f"{option}: expected each name once, got {twice!r} twice: leave one out, or rename it")
    return found


def _argument(text: str) -> tuple[str, object]:
    """Return a name and what JSON makes of its value; a plain word is itself, for a shell eats its quotes."""
    import msgspec

    key, sign, value = text.partition("=")
    if not sign:
        raise ValueError(f"expected name=value, got {text!r}")
    try:
        return key, msgspec.json.decode(value)
    except msgspec.DecodeError as error:
        if value.isidentifier():
            return key, value
        raise ValueError(
            f"{key}: expected a number, true, false, a list in brackets or a word, got {value!r} ({error})"
        ) from error
