"""What a fit came to, as one page that stands alone: tables and drawings, no script, nothing to fetch."""

from collections.abc import Iterable, Sequence
from html import escape
from io import StringIO

import numpy as np
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from numpy.typing import NDArray

from config.arm import ArmConfig
from sim_twin.fitted import nominal_plant
from sim_twin.fitting.fit import Fit, FitRow
from sim_twin.fitting.model import ArmAlone
from sim_twin.fitting.stream import Piece
from sim_twin.fitting.values import JOINTS, vector_of

__all__ = ["report_page"]

Array = NDArray[np.float64]
MOST_DRAWN = 1500
_STYLE = """body{font:15px/1.45 system-ui,sans-serif;max-width:62rem;margin:2rem auto;padding:0 1rem;color:#212529}
table{border-collapse:collapse;margin:.6rem 0 1.4rem}td,th{padding:.2rem .8rem;border-bottom:1px solid #dee2e6}
td+td,th+th{text-align:right}td:last-child{text-align:left}h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem}
.not td{color:#868e96}svg{max-width:100%;height:auto}"""


def report_page(
    fit: Fit, arm: ArmConfig, held_out: Sequence[Piece], *, physics_s: float, versions: Sequence[tuple[str, str]]
) -> str:
    """Return the page.

    Args:
        fit: what it came to.
        arm: the file that it began with.
        held_out: what was not fitted.
        physics_s: a step of the twin's physics.
        versions: of what was used.
    """
    told = [row for row in fit.rows if row.half is not None]
    untold = [row for row in fit.rows if row.half is None]
    parts = [
        f"<h1>Twin of {escape(fit.model)} {escape(fit.serial)}</h1>",
        f"<p>Fitted to {fit.seconds:.1f} s of free motion, judged on {fit.held_out_s:.1f} s that were not fitted. "
        f"Sessions: {escape(', '.join(fit.sessions))}.</p>",
        "<h2>Joints, twin less arm, on what was not fitted</h2>", _errors_table(fit),
        _drawing(_errors_figure(fit, arm, held_out, physics_s)),
        "<h2>What the sessions tell</h2>", _values_table(told),
        "<h2>What they do not tell</h2><p>These are taken to be about what the file has.</p>",
        _values_table(untold, is_told=False),
        "<h2>Payload by the force on the tool</h2>",
        f"<p>{fit.force_kg:.2f} ± {fit.force_half_kg:.2f} kg more than the controller knows of. Whoever zeroed the "
        "sensor since took it away from here; the joints' droop above does not know of that.</p>",
        "<h2>Lengths</h2>", _lengths(fit),
        "<h2>How</h2>", _how(fit), "<p>" + escape(", ".join(f"{name} {v}" for name, v in versions)) + "</p>",
    ]  # fmt: skip
    return (
        "<!doctype html><html lang='en'><meta charset='utf-8'><title>twin fit</title>"
        f"<style>{_STYLE}</style>{''.join(parts)}</html>\n"
    )


def _errors_table(fit: Fit) -> str:
    rows = [
        (joint, *(f"{1e3 * value:.3f}" for value in values))
        for joint, *values in zip(
            JOINTS, fit.before.rms_rad, fit.before.worst_rad, fit.after.rms_rad, fit.after.worst_rad, strict=True
        )
    ]
    return _table(("mrad", "rms before", "worst before", "rms after", "worst after"), rows)


def _values_table(rows: Iterable[FitRow], *, is_told: bool = True) -> str:
    cells = [
        (
            row.name, _number(row.before), _number(row.value),
            "–" if row.half is None else f"± {_number(row.half)}", row.unit, row.why,
        )
        for row in rows
    ]  # fmt: skip
    if not cells:
        return "<p>Nothing.</p>"
    return _table(("", "file", "fitted", "95 %", "", ""), cells, kind="" if is_told else "not")


def _lengths(fit: Fit) -> str:
    if not fit.lengths:
        return "<p>The sessions turn the tool too little, or tell no pose of it.</p>"
    unit = {"m": ("mm", 1e3), "rad": ("mrad", 1e3)}
    rows = [
        (
            row.name, f"{row.value * unit[row.unit][1]:+.4f}",
            "–" if row.half is None else f"± {row.half * unit[row.unit][1]:.4f}", unit[row.unit][0], row.why,
        )
        for row in fit.lengths
    ]  # fmt: skip
    return (
        f"<p>The tool was at most {1e3 * fit.tool_before_m:.3f} mm off where its controller has it by the file's rows, "
        f"{1e3 * fit.tool_after_m:.4f} mm by these. Offsets from the file's Denavit-Hartenberg rows:</p>"
        + _table(("", "offset", "95 %", "", ""), rows)
    )


def _how(fit: Fit) -> str:
    noise = ", ".join(f"{1e3 * n:.3f}" for n in fit.noise_rad)
    return (
        "<p>Least squares of the measured joints against the twin's arm alone, driven with the same commands "
        "(mujoco.minimize; the masses are the file's). Intervals: of independent errors, or of errors that last "
        "(Newey and West), whichever is wider; they hold as far as the twin's kind of servo, friction and load is the "
        f"arm's. Left over, mrad: {noise}.</p>"
    )


def _errors_figure(fit: Fit, arm: ArmConfig, held_out: Sequence[Piece], physics_s: float) -> Figure:
    opening_m = float(np.mean([p.opening_m for p in held_out]))
    alone = ArmAlone(arm, tick_s=held_out[0].tick_s, physics_s=physics_s, opening_m=opening_m)
    both = np.stack([vector_of(nominal_plant(arm)), vector_of(fit.plant)])
    piece = held_out[0]
    errors = 1e3 * (alone.joints(both, piece) - piece.q_rad)
    every = max(1, piece.n // MOST_DRAWN)
    at_s = piece.tick_s * np.arange(piece.n)[::every]
    figure = Figure(figsize=(10, 7), layout="constrained")
    for axes, joint, k in zip(figure.subplots(6, 1, sharex=True), JOINTS, range(6), strict=True):
        axes.plot(at_s, errors[0, ::every, k], color="#adb5bd", linewidth=0.9, label="file")
        axes.plot(at_s, errors[1, ::every, k], color="#1c7ed6", linewidth=0.9, label="fitted")
        axes.set_ylabel(f"{joint}\nmrad", fontsize=8)
    figure.axes[0].legend(fontsize=8, loc="upper right")
    figure.axes[-1].set_xlabel("time of the first piece that was not fitted, s")
    return figure


def _drawing(figure: Figure) -> str:
    FigureCanvasSVG(figure)
    text = StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()[text.getvalue().index("<svg") :]


def _number(value: float) -> str:
    return f"{value:.4g}"


def _table(head: Sequence[str], rows: Iterable[Sequence[str]], *, kind: str = "") -> str:
    def line(cells: Iterable[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    return f"<table class='{kind}'>{line(head, 'th')}{''.join(line(row, 'td') for row in rows)}</table>"
