"""`autotelic node`: one process of a rig, as `autotelic up` starts it. The edge."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from config.loader import resolve
from config.rig import Rig
from robot.errors import SafetyError
from robot.rigs import load
from robot.stop_request import StopRequest

__all__ = ["app"]

PERCEIVER, SHOWER = "perception.node:run_perception", "perception.camera_node:run_camera"
"""Which room perceives is not known here."""

app = typer.Typer(no_args_is_help=True, help="One process of a rig, as `autotelic up` starts it.")


@app.callback()
def _group() -> None:
    """Turn it into a group, whatever nodes there are."""


@app.command()
def hub(
    rig: Annotated[str, typer.Option(help="A rig's file, or a shipped rig's name.")] = "virtual_lab",
    scenario: Annotated[str, typer.Option(help="A shipped scenario's name or a file.")] = "paper",
) -> None:
    """Be the hub of a rig's bus until Ctrl-C, where no virtual controller is it."""
    from robot.node.hub import run_hub  # brings the bus

    resolved = resolve(rig=rig, scenario=scenario)
    with StopRequest() as end:
        run_hub(resolved.rig, end=end)


@app.command()
def robot(
    rig: Annotated[str, typer.Option(help="A shipped rig's name or a file.")] = "virtual_lab",
    scenario: Annotated[str, typer.Option(help="A shipped scenario's name or a file.")] = "paper",
    pictures: Annotated[Path, typer.Option(help="Folder for pictures of what belongs where.")] = Path("resets"),
) -> None:
    """Hold a rig's arm and serve it over the bus until Ctrl-C. Arms nothing by itself.

    Where a person arms the arm or lays the table out, that is whoever sits at this command's terminal.
    """
    from robot.node.lab_node import open_robot_node  # brings the bus and the arm's client

    resolved = resolve(rig=rig, scenario=scenario)
    _require_terminal(resolved.rig)
    with StopRequest() as end, open_robot_node(resolved, pictures=pictures) as node:
        typer.echo(f"robot node of {resolved.rig.name}: disarmed, waits for a source at {resolved.rig.bus}", err=True)
        node.run(end)


def _require_terminal(rig: Rig) -> None:
    """Raise SafetyError where a person is needed at a real arm, and none can be at this process's input."""
    is_terminal = sys.stdin is not None and sys.stdin.isatty()
    if rig.reset == "person" and rig.expected.kind == "real" and not is_terminal:
        raise SafetyError(
            f"rig {rig.name}: expected a person at a terminal, beside the arm; standard input is none. Nothing was "
            "connected to, nothing moves"
        )


@app.command()
def recorder(
    rig: Annotated[str, typer.Option(help="A shipped rig's name or a file.")] = "virtual_lab",
    scenario: Annotated[str, typer.Option(help="A shipped scenario's name or a file.")] = "paper",
    out: Annotated[Path, typer.Option(help="Folder for the sessions.")] = Path("sessions"),
    person: Annotated[str, typer.Option(help="Who attends, as they want to be called in the files.")] = "unnamed",
) -> None:
    """Record what a rig's processes write, and what its learner tells of itself, until Ctrl-C."""
    from robot.recording.recorder_node import run_recorder  # brings the bus

    resolved = resolve(rig=rig, scenario=scenario)
    with StopRequest() as end:
        recorded = run_recorder(resolved, out, person=person, end=end, tell=lambda line: typer.echo(line, err=True))
    typer.echo(f"{out}: {recorded.n} messages, {recorded.lost()} lost, {recorded.n_left_out} left out", err=True)


@app.command()
def perception(
    rig: Annotated[str, typer.Option(help="A shipped rig's name or a file.")] = "virtual_lab",
    scenario: Annotated[str, typer.Option(help="A shipped scenario's name or a file.")] = "paper",
) -> None:
    """Perceive for a rig's robot node until Ctrl-C."""
    resolved = resolve(rig=rig, scenario=scenario)
    with StopRequest() as end:
        load(PERCEIVER)(resolved, end=end)


@app.command()
def camera(
    rig: Annotated[str, typer.Option(help="A rig's file, or a shipped rig's name.")] = "virtual_lab_camera",
    scenario: Annotated[str, typer.Option(help="A shipped scenario's name or a file.")] = "paper",
) -> None:
    """Own a rig's camera and show its frames to the perception node until Ctrl-C."""
    resolved = resolve(rig=rig, scenario=scenario)
    with StopRequest() as end:
        load(SHOWER)(resolved, end=end)
