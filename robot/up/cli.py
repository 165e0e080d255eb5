"""`autotelic up RIG`: start a rig's processes and see to them until Ctrl-C or until the job is done. The edge."""

import math
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from shutil import disk_usage
from time import monotonic
from typing import TYPE_CHECKING, Annotated

import msgspec
import numpy as np
import typer
from rich.console import Console
from rich.live import Live

from config.loader import resolve
from config.resolved import Resolved
from config.rig import Rig
from config.sources import read_source
from robot.stop_request import StopRequest

if TYPE_CHECKING:
    from robot.up.faults import RandomFaults
    from robot.up.night_watch import NightWatch
    from robot.up.plan import NodePlan
    from robot.up.summary import Summary
    from robot.up.supervisor import Supervisor

__all__ = ["up"]


def up(
    rig: Annotated[str, typer.Argument(help="A shipped rig's name or a file.")],
    more: Annotated[list[str] | None, typer.Argument(help="Words for the job's command, after --.")] = None,
    scenario: Annotated[str, typer.Option(help="A shipped scenario's name or a file.")] = "paper",
    without: Annotated[list[str] | None, typer.Option("--without", help="A node that is left out.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for logs and run.  [default: runs/up-RIG]")] = None,
    *,
    night: Annotated[
        bool, typer.Option("--night", help="Nobody attends: too many stops end it, or a full disk.")
    ] = False,
    hours: Annotated[float, typer.Option(min=0.1, help="With --night: room on the disk is asked for so long.")] = 10.0,
    alert: Annotated[
        str, typer.Option(help="With --night: a command that is told, as its last word, how it ended.")
    ] = "",
    fault_every: Annotated[
        float, typer.Option(min=0.0, help="Seconds between faults on purpose, of a virtual plant alone; 0: none.")
    ] = 0.0,
    seed: Annotated[int, typer.Option(min=0, help="With --fault-every: which faults are drawn.")] = 0,
    seconds: Annotated[float, typer.Option(min=0.0, help="Ends after so long; 0: when its job is done.")] = 0.0,
    json: Annotated[bool, typer.Option("--json", help="Print a summary as one JSON object at the end.")] = False,
) -> None:
    """Start a rig's processes, watch them, start again what ends, and end them on Ctrl-C: the arm first and last.

    Words after -- go to the job: `autotelic up virtual_lab -- --epochs 50`. Exit code 0 if nothing went wrong, 3 if
    something did and was mended, 1 if it was not. With --night OUT/morning.md tells how it went.
    """
    from robot.bus.session import Bus
    from robot.bus.topic import Role
    from robot.up.logs import Logs
    from robot.up.night import check_night
    from robot.up.night_watch import NightWatch
    from robot.up.plan import plans_of
    from robot.up.summary import Event
    from robot.up.supervisor import Supervisor

    resolved = resolve(rig=rig, scenario=scenario)
    found = resolved.rig
    folder = out or Path("runs") / f"up-{found.name}"
    plans = plans_of(found, _values(resolved, rig, scenario, folder), without=without or (), more=more or ())
    console = Console(stderr=True)

    def tell(event: Event) -> None:
        if not console.is_terminal:
            typer.echo(f"{event.at_s:.2f} s, {event.node}: {event.what}", err=True)

    def make_bus() -> Bus:
        assert found.bus is not None, "a robot node has one"
        return Bus(found.bus, serial=found.expected.serial, role=Role.VIEWER, source="supervisor", keys=found.keys)

    folder.mkdir(parents=True, exist_ok=True)
    watch = NightWatch(folder, alert=alert, say=lambda line: typer.echo(line, err=True)) if night else None
    if watch is not None:
        check_night(found, hours=hours, free_bytes=disk_usage(folder).free)
    logs = Logs(folder / "logs")
    supervisor = Supervisor(
        plans,
        make_bus=make_bus,
        logs=logs,
        rig=found.name,
        tell=tell,
        night=watch,
        faults=_faults_of(found, plans, fault_every, seed),
    )
    summary = _run(supervisor, console, seconds)
    logs.close()
    if watch is not None:
        _leave_word(watch, supervisor.why_over, summary, folder)
    if json:
        typer.echo(msgspec.json.encode(summary).decode())
    else:
        typer.echo(f"{summary.seconds:.0f} s, {len(summary.events)} events; logs in {summary.logs}", err=True)
    raise typer.Exit(summary.exit_code)


def _faults_of(rig: Rig, plans: "tuple[NodePlan, ...]", every_s: float, seed: int) -> "RandomFaults | None":
    """Return the faults that are asked for; None where none are.

    Raises:
        RobotConfigError: the rig's plant is not a virtual one.
    """
    from robot.up.faults import RandomFaults, check_faults

    if not every_s:
        return None
    check_faults(rig)
    return RandomFaults([plan.name for plan in plans], every_s=every_s, rng=np.random.default_rng(seed))


def _run(supervisor: "Supervisor", console: Console, seconds: float) -> "Summary":
    """Run it until Ctrl-C, until its job is done, or for so long, with a live table in a terminal."""
    from robot.up.table import status_table

    shown: AbstractContextManager[Live | None] = (
        Live(console=console, refresh_per_second=4) if console.is_terminal else nullcontext()
    )
    end_s = monotonic() + seconds if seconds else math.inf
    with StopRequest() as end, shown as live:
        return supervisor.run(
            lambda: end() or monotonic() > end_s,
            look=lambda: None if live is None else live.update(status_table(supervisor)),
        )


def _leave_word(watch: "NightWatch", why_over: str | None, summary: "Summary", folder: Path) -> None:
    """Write the morning's report and tell whoever is to be told."""
    from robot.up.morning import morning_report

    budget = watch.budget
    report = morning_report(summary, budget.stops, n_stops=budget.n, why_over=why_over)
    (folder / "morning.md").write_text(report, encoding="utf-8")
    watch.tell(report.splitlines()[0].removeprefix("# ") + (f"; {why_over}" if why_over else ""))


def _values(resolved: Resolved, rig: str, scenario: str, folder: Path) -> dict[str, str]:
    """Return what stands for the names in braces; files as they are found from here."""
    found, source = resolved.rig, read_source("rigs", rig)
    cell = found.cell or ""
    if "/" in cell and source.folder is not None:
        cell = str(source.folder / cell)
    return {
        "rig": rig, "scenario": scenario, "address": found.address or "", "bus": found.bus or "",
        "keys": found.keys or "", "cell": cell, "out": str(folder),
    }  # fmt: skip
