"""The bench command: runs one registered bench and prints its rows as a table or as JSON."""

import inspect
import os
import platform
from collections.abc import Iterable
from importlib.metadata import EntryPoint, PackageNotFoundError, entry_points, version
from pathlib import Path
from typing import Annotated, Protocol

import msgspec
import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from robot.stdio import STDERR, redirected_stdout

__all__ = ["BENCH_GROUP", "Bench", "BenchReport", "BenchResult", "bench", "bench_report"]

BENCH_GROUP = "autotelic.benches"
VERSIONS_OF = (
    "autotelic",
    "mujoco",
    "placo",
    "ruckig",
    "torch",
    "numpy",
    "msgspec",
    "ur_rtde",
    "eclipse-zenoh",
    "pyzmq",
)


class BenchResult(msgspec.Struct, frozen=True, kw_only=True):
    """One row: a figure, what it should be, and whether it is."""

    name: str
    value: float
    unit: str
    goal: str = ""
    """What the figure is asked to be, in words (`<= 300`); empty where nothing is asked."""
    ok: bool = True
    details: dict[str, str] | msgspec.UnsetType = msgspec.UNSET
    """What stands behind the figure, in words, by name; absent where nothing does."""


class BenchReport(msgspec.Struct, frozen=True, kw_only=True):
    """What a bench found, on which machine and with which versions."""

    bench: str
    results: tuple[BenchResult, ...]
    machine: dict[str, str | int]
    versions: dict[str, str]
    seconds: float


class Bench(Protocol):
    """A registered bench.

    Further keywords: `run` of one that reads a run folder, `seconds` of any length, `frames` of photographs.
    """

    def __call__(self, *, full: bool) -> BenchReport:
        """Measure; full takes the numbers an issue asks for, else at most 50 s."""
        ...


def bench_report(name: str, results: Iterable[BenchResult], *, seconds: float) -> BenchReport:
    """Return the report of results measured just now on this machine, in `seconds` of wall time."""
    return BenchReport(
        bench=name, results=tuple(results), machine=_machine(), versions=_versions(), seconds=round(seconds, 3)
    )


def bench(
    name: Annotated[str, typer.Argument(help="Which bench; `list` names them.")],
    run: Annotated[Path | None, typer.Argument(help="Run folder, for benches that read one.")] = None,
    *,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
    full: Annotated[bool, typer.Option("--full", help="Take all the samples, however long it lasts.")] = False,
    seconds: Annotated[
        float | None,
        typer.Option("--seconds", min=1.0, help="How long, for a bench that takes any length."),
    ] = None,
    frames: Annotated[
        Path | None, typer.Option("--frames", help="Folder of measured photographs, for a bench that looks at them.")
    ] = None,
) -> None:
    """Measure and print figures; exit code 1 if one of them misses its goal."""
    known = {point.name: point for point in entry_points(group=BENCH_GROUP)}
    if name == "list":
        typer.echo("\n".join(sorted(known)))
        return
    if name not in known:
        raise typer.BadParameter(f"expected one of {', '.join(sorted(known))}, got {name}", param_hint="NAME")
    report = _measure(known[name], full=full, run=run, seconds=seconds, frames=frames)
    if json:
        typer.echo(msgspec.json.encode(report).decode())
    else:
        _print_table(report)
    if not all(result.ok for result in report.results):
        raise typer.Exit(1)


def _measure(
    point: EntryPoint, *, full: bool, run: Path | None, seconds: float | None, frames: Path | None
) -> BenchReport:
    """Load and call a bench, handing it the run folder, the length and the photographs if it takes them."""
    function = point.load()
    known = inspect.signature(function).parameters
    if run is not None and "run" not in known:
        raise typer.BadParameter(f"bench {point.name} reads no run folder", param_hint="RUN")
    if seconds is not None and "seconds" not in known:
        raise typer.BadParameter(f"bench {point.name} has a length of its own", param_hint="--seconds")
    if frames is not None and "frames" not in known:
        raise typer.BadParameter(f"bench {point.name} looks at no photographs", param_hint="--frames")
    offered = {"run": run, "seconds": seconds, "frames": frames}
    with redirected_stdout(STDERR):
        return function(full=full, **{name: value for name, value in offered.items() if name in known})


def _print_table(report: BenchReport) -> None:
    has_details = any(result.details for result in report.results)
    table = Table(
        "name",
        "value",
        "unit",
        "goal",
        "ok",
        *(["details"] * has_details),
        title=f"bench {report.bench}, {report.seconds:.1f} s",
    )
    for result in report.results:
        verdict = "" if not result.goal else "yes" if result.ok else "NO"
        details = ", ".join(f"{key} {text}" for key, text in (result.details or {}).items())
        table.add_row(
            result.name, f"{result.value:.6g}", result.unit, result.goal, verdict, *([escape(details)] * has_details)
        )
    console = Console()
    console.print(table)
    machine = ", ".join(f"{key} {value}" for key, value in report.machine.items())
    console.print(machine, "; ", ", ".join(f"{key} {value}" for key, value in report.versions.items()), style="dim")


def _machine() -> dict[str, str | int]:
    """Return what of this computer matters to a figure; no host name."""
    return {
        "cpu": _cpu_model(),
        "cores": len(os.sched_getaffinity(0)),
        "system": platform.system(),
        "arch": platform.machine(),
        "python": platform.python_version(),
    }


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "unknown")


def _versions() -> dict[str, str]:
    return {name: _version(name) for name in VERSIONS_OF}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"
