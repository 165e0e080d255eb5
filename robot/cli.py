"""The `autotelic` command: every sub-command is an entry point, imported only when it is called."""

import os
from collections.abc import Callable
from importlib.metadata import EntryPoint, entry_points, version
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from config.errors import ConfigError
from robot.errors import RobotConfigError, RobotError

__all__ = ["COMMAND_GROUP", "app", "main"]

COMMAND_GROUP = "autotelic.commands"
EXIT_FAILED = 1
EXIT_USAGE = 2


class EntryPointGroup(TyperGroup):
    """A command group whose members are the entry points of `autotelic.commands`."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ANN401, ARG002
        """Return the names of all registered sub-commands."""
        return sorted(_points())

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ANN401, ARG002
        """Import and return one sub-command, None if there is none of that name."""
        point = _points().get(cmd_name)
        return None if point is None else _load(point)

    def invoke(self, ctx: Any) -> Any:  # noqa: ANN401
        """Run the sub-command; an error raised on purpose becomes one line and an exit code."""
        try:
            return super().invoke(ctx)
        except (ConfigError, RobotConfigError) as error:
            typer.echo(f"error: {error}", err=True)
            raise typer.Exit(EXIT_USAGE) from error
        except RobotError as error:
            typer.echo(f"error: {error}", err=True)
            raise typer.Exit(EXIT_FAILED) from error


app = typer.Typer(
    cls=EntryPointGroup,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="A UR5e and its simulated twin that teach themselves a table of interdependent goals.",
)


def _tell_version(is_asked: bool) -> None:
    if is_asked:
        typer.echo(f"autotelic {version('autotelic')}")
        raise typer.Exit


@app.callback()
def _root(
    *,
    _version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_tell_version, is_eager=True)
    ] = False,
) -> None:
    """Turn the Typer application into a group, whatever sub-commands there are."""


def main() -> None:
    """Run the command line.

    Numerical libraries get one thread unless the environment says otherwise: what runs here is many small sums, and
    idle worker threads of one process take time from the next.
    """
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    app()


def _points() -> dict[str, EntryPoint]:
    return {point.name: point for point in entry_points(group=COMMAND_GROUP)}


def _load(point: EntryPoint) -> Any:  # noqa: ANN401
    """Import what an entry point names, an application or one function, and make it a command of that name."""
    try:
        registered = point.load()
    except ModuleNotFoundError as error:
        anything = {"ignore_unknown_options": True, "allow_extra_args": True}
        registered = _application(point.name, _unavailable(point.name, error), context_settings=anything)
    if not isinstance(registered, typer.Typer):
        registered = _application(point.name, registered)
    command = typer.main.get_command(registered)
    command.name = point.name
    return command


def _application(
    name: str, function: Callable[..., None], *, context_settings: dict[str, Any] | None = None
) -> typer.Typer:
    """Return an application of one function."""
    single = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    single.command(name=name, context_settings=context_settings)(function)
    return single


def _unavailable(name: str, error: ModuleNotFoundError) -> Callable[[], None]:
    """Return a command that says which module is missing, so that the other sub-commands go on working."""

    def say() -> None:
        typer.echo(f"error: {name} cannot be loaded: {error}; is the extra that brings it installed?", err=True)
        raise typer.Exit(EXIT_FAILED)

    say.__doc__ = f"Not available: {error}."
    return say
