"""`autotelic twin fit`: sessions in, a twin out. The edge."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer
from rich.console import Console
from rich.table import Table

from robot.bench import bench_report
from robot.stdio import STDERR, redirected_stdout

if TYPE_CHECKING:
    from sim_twin.fitting.fit import Fit

__all__ = ["fit"]


def fit(
    sessions: Annotated[list[Path], typer.Argument(help="Sessions of one arm, with every tick in them.")],
    *,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to write to; nothing is overwritten.")] = Path(
        "twin_fit"
    ),
    json: Annotated[bool, typer.Option("--json", help="Print one JSON object.")] = False,
) -> None:
    """Fit the twin's servos, friction, payload and lengths to sessions, and say what they do not tell.

    Writes the arm's file with what was fitted, a rig that names it, and a page with what it came to.
    """
    from sim_twin.fitting.fit import fit_sessions  # brings the physics and the sessions' reader
    from sim_twin.fitting.report import report_page
    from sim_twin.fitting.written import ARM, PAGE, RIG, check_new, write_fit

    check_new(out)
    with redirected_stdout(STDERR):
        found, resolved, _, held_out = fit_sessions(sessions)
        versions = sorted(bench_report("fit", (), seconds=0.0).versions.items())
        physics_s = min(resolved.rig.physics_s, resolved.rig.tick_s)
        page = report_page(found, resolved.arm, held_out, physics_s=physics_s, versions=versions)
        write_fit(out, found, resolved, page)
    if json:
        typer.echo(msgspec.json.encode(found).decode())
        return
    _print(found)
    typer.echo(f"{out / PAGE}: the page; {out / RIG}: a rig of this twin; {out / ARM}: the arm's file that it names")


def _print(found: "Fit") -> None:
    console = Console()
    table = Table("", "file", "fitted", "95 %", "unit", title=f"{found.model} {found.serial}, {found.seconds:.1f} s")
    for row in found.rows:
        half = "not told" if row.half is None else f"± {row.half:.3g}"
        table.add_row(row.name, f"{row.before:.5g}", f"{row.value:.5g}", half, row.unit)
    console.print(table)
    for row in found.rows:
        if row.half is None:
            console.print(f"not told: {row.name}: {row.why}", highlight=False, markup=False)
    worst = (1e3 * max(found.before.worst_rad), 1e3 * max(found.after.worst_rad))
    console.print(
        f"joints on what was not fitted ({found.held_out_s:.1f} s): at most {worst[0]:.2f} mrad off before, "
        f"{worst[1]:.2f} mrad after; the tool by its lengths {1e3 * found.tool_before_m:.2f} mm before, "
        f"{1e3 * found.tool_after_m:.3f} mm after",
        highlight=False,
        markup=False,
    )
