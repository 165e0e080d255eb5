"""`autotelic twin shadow`: the twin beside an arm that runs, or beside one that was recorded. The edge."""

from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer
from rich.console import Console
from rich.live import Live

from config.errors import ConfigError
from config.fitted import FittedPlant
from robot.stdio import STDERR, redirected_stdout
from robot.stop_request import StopRequest

if TYPE_CHECKING:
    from sim_twin.shadowing.beside import Bounds
    from sim_twin.shadowing.told import ShadowTold

__all__ = ["shadow"]

EXIT_LATCHED = 1


def shadow(
    *,
    session: Annotated[Path | None, typer.Option(help="A recorded session, in place of an arm that runs.")] = None,
    rig: Annotated[str, typer.Option("--rig", "-r", help="Shipped rig or a file: whose bus is listened to.")] = "lab",
    scenario: Annotated[str, typer.Option("--scenario", "-s", help="Its table: a shipped name or a file.")] = "paper",
    bus: Annotated[str, typer.Option("--bus", help="The bus's endpoint, where it is another than the rig's.")] = "",
    fitted: Annotated[
        str, typer.Option(help="An arm's file that `autotelic twin fit` wrote: what is known of this arm.")
    ] = "",
    bound_mrad: Annotated[float, typer.Option(min=0.1, help="How far a joint may be off its twin.")] = 30.0,
    bound_mm: Annotated[float, typer.Option(min=0.1, help="How far the tool may be.")] = 20.0,
    seconds: Annotated[float, typer.Option(min=0.0, help="How long; 0 until Ctrl-C.")] = 0.0,
    look_only: Annotated[bool, typer.Option("--look-only", help="Say no stop where a bound is passed.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object at the end.")] = False,
) -> None:
    """Let the twin follow an arm's commands beside it, and show how far the two are apart and what that looks like.

    A bound that is passed stops the arm, as anybody may over the bus, and ends this with exit code 1.
    """
    from sim_twin.shadowing.beside import Bounds  # brings the physics
    from sim_twin.shadowing.told import lines

    bounds = Bounds(q_rad=1e-3 * bound_mrad, tcp_m=1e-3 * bound_mm)
    known = _known(fitted)
    with redirected_stdout(STDERR):
        if session is not None:
            told = _of_session(session, known, bounds)
        else:
            told = _of_bus(rig, scenario, bus, known, bounds, seconds=seconds, says_stop=not look_only)
    if json:
        typer.echo(msgspec.json.encode(told).decode())
    else:
        for line in lines(told):
            typer.echo(line)
    if told.latched:
        raise typer.Exit(EXIT_LATCHED)


def _of_session(path: Path, fitted: FittedPlant | None, bounds: "Bounds") -> "ShadowTold":
    from sim_twin.shadowing.session import shadow_session
    from sim_twin.shadowing.told import Worst, told_of

    worst = Worst()
    beside = shadow_session(path, fitted=fitted, bounds=bounds, look=worst.look)
    return told_of(beside, worst)


def _of_bus(
    rig: str, scenario: str, endpoint: str, fitted: FittedPlant | None, bounds: "Bounds", *, seconds: float,
    says_stop: bool,
) -> "ShadowTold":  # fmt: skip
    from config.loader import resolve
    from sim_twin.shadowing.told import Worst, table_of, told_of
    from sim_twin.shadowing.watch import BusShadow, open_bus

    resolved = resolve(rig=rig, scenario=scenario)
    if fitted is not None:
        resolved = msgspec.structs.replace(resolved, arm=msgspec.structs.replace(resolved.arm, fitted=fitted))
    worst = Worst()
    console = Console(stderr=True)
    with open_bus(resolved, endpoint=endpoint) as joined, StopRequest() as is_asked, Live(console=console) as live:
        beside = BusShadow(joined, resolved, bounds=bounds, says_stop=says_stop, look=worst.look)
        end_s = monotonic() + seconds if seconds else None
        try:
            beside.run(
                lambda: is_asked() or (end_s is not None and monotonic() >= end_s),
                tell=lambda now: live.update(table_of(now.beside, worst)),
            )
        finally:
            beside.close()
    if beside.beside.latched is not None and says_stop:
        took = "nobody confirmed the stop: look at the arm"
        if beside.stopped_s is not None:
            took = f"the arm was stopped, confirmed after {1e3 * beside.stopped_s:.0f} ms"
        typer.echo(took, err=True)
    return told_of(beside.beside, worst)


def _known(fitted: str) -> FittedPlant | None:
    """Return what an arm's file has of a fit.

    Raises:
        ConfigError: it is no such file, or nothing was fitted.
    """
    if not fitted:
        return None
    from config.loader import load_arm

    found = load_arm(fitted).fitted
    if found is None:
        raise ConfigError(fitted, "fitted", "what `autotelic twin fit` found", "nothing of it")
    return found
