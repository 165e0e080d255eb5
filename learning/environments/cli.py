"""`autotelic agent KIND`: what an agent of stable-baselines3 reaches on a scene. The edge: terminal and files."""

from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import msgspec
import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from config.errors import ConfigError
from config.loader import load_wired
from learning.environments.course import Course, Score, Wanted, read_course, run_course
from robot.stop_request import StopRequest

__all__ = ["agent"]

EXIT_USAGE, EXIT_INTERRUPTED = 2, 130
KINDS = ("flat", "her")


def agent(
    kind: Annotated[str, typer.Argument(help="`flat`: soft actor-critic; `her`: the same with hindsight.")],
    scenario: Annotated[str, typer.Option(help="Shipped scenario or a file.")] = "paper",
    rig: Annotated[str, typer.Option(help="Shipped rig or a file, in lock-step.")] = "twin",
    seed: Annotated[int, typer.Option(min=0)] = 0,
    epoch: Annotated[int, typer.Option(min=0, help="Of the scenario's schedule, whose rules are in force.")] = 0,
    steps: Annotated[int, typer.Option(min=1, help="Time steps to learn from.")] = 60_000,
    every: Annotated[int, typer.Option(min=1, help="Time steps between tests of all goals.")] = 10_000,
    tests: Annotated[int, typer.Option(min=1, help="Test episodes of each goal.")] = 10,
    out: Annotated[Path | None, typer.Option(help="Folder.  [default: runs/agent-KIND-SEED]")] = None,
    *,
    json: Annotated[bool, typer.Option("--json", help="Print what came of it as one JSON object.")] = False,
) -> None:
    """Train one network on a scene by the same intents, reflexes and limits, and test each goal every so often.

    Each episode wants a goal drawn evenly, and has as many time steps as an epoch of ours. Ctrl-C keeps everything up
    to the last test (exit code 130); the same command goes on from there.
    """
    if kind not in KINDS:
        raise typer.BadParameter(f"expected one of {', '.join(KINDS)}, got {kind}", param_hint="KIND")
    wanted = Wanted(
        agent=kind, scenario=scenario, rig=rig, seed=seed, epoch=epoch, n_steps=steps, every=every, n_tests=tests
    )
    folder = out or Path("runs") / f"agent-{kind}-{seed}"
    try:
        course = _taken_up(wanted, folder)
        course = _run(course, folder)
    except ConfigError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(EXIT_USAGE) from error
    if json:
        typer.echo(msgspec.json.encode(course).decode())
    else:
        Console().print(_table(course))
    if not course.scores or course.scores[-1].n_steps < steps:
        raise typer.Exit(EXIT_INTERRUPTED)


def _taken_up(wanted: Wanted, folder: Path) -> Course:
    """Return what a folder holds, or a new course."""
    goals = tuple(goal.name for goal in load_wired(wanted.scenario)[0].goals)
    known = read_course(folder)
    if known is None:
        return Course(wanted=wanted, goals=goals)
    if msgspec.structs.replace(known.wanted, n_steps=wanted.n_steps) != wanted:
        raise typer.BadParameter(f"{folder} holds another course: name another folder", param_hint="--out")
    return msgspec.structs.replace(known, wanted=wanted)


def _run(course: Course, folder: Path) -> Course:
    wanted = course.wanted
    agents = _agents()
    folder.mkdir(parents=True, exist_ok=True)
    scene = {"scenario": wanted.scenario, "rig": wanted.rig, "epoch": wanted.epoch}
    made = agents.Agent(wanted.agent, scene, seed=wanted.seed)
    bar = Progress(
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(),
        console=Console(stderr=True), transient=True,
    )  # fmt: skip
    try:
        n_done = course.scores[-1].n_steps if course.scores else 0
        if n_done:
            made.take_up(folder, n_steps=n_done)
        with StopRequest() as stop, bar:
            task = bar.add_task(wanted.agent, total=wanted.n_steps, completed=n_done)
            return run_course(
                made, course, folder, should_stop=stop, when_stepped=lambda: bar.advance(task),
                when_tested=lambda score: bar.console.print(_told(score, course.goals)),
            )  # fmt: skip
    finally:
        made.close()


def _agents() -> Any:  # noqa: ANN401 - a module of an extra
    try:
        return import_module("learning.environments.agents")
    except ModuleNotFoundError as error:
        message = f"expected stable-baselines3 and gymnasium (pip install 'autotelic[agents]'), {error.name} is missing"
        raise typer.BadParameter(message, param_hint="KIND") from error


def _told(score: Score, goals: tuple[str, ...]) -> str:
    shares = ", ".join(f"{name} {n}" for name, n in zip(goals, score.n_successes, strict=True))
    return f"{score.n_steps} time steps: {shares}"


def _table(course: Course) -> Table:
    table = Table(
        "time steps", *course.goals, title=f"{course.wanted.agent}: successes of {course.wanted.n_tests} tests"
    )
    for score in course.scores:
        table.add_row(str(score.n_steps), *map(str, score.n_successes))
    return table
