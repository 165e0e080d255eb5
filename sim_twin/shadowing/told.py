"""How a shadow is, for people and for scripts."""

from typing import TYPE_CHECKING

import msgspec
from rich.table import Table

from sim_twin.fitting.values import JOINTS
from sim_twin.shadowing.causes import Cause

if TYPE_CHECKING:
    from sim_twin.shadowing.beside import Apart, TwinBeside

__all__ = ["ShadowTold", "Worst", "lines", "table_of", "told_of"]


class Worst:
    """Remembers how far apart plant and twin have been."""

    def __init__(self) -> None:
        self.q_rad = [0.0] * 6
        self.tcp_m, self.n_other_inputs = 0.0, 0
        self._n = 0

    def look(self, beside: "TwinBeside") -> None:
        """Take note of the newest tick, once."""
        apart = beside.apart
        if apart is None or beside.n_compared == self._n:
            return
        self._n = beside.n_compared
        self.q_rad = [max(a, abs(b)) for a, b in zip(self.q_rad, apart.q_rad, strict=True)]
        self.tcp_m = max(self.tcp_m, _length(apart))
        self.n_other_inputs += bool(apart.inputs)


class ShadowTold(msgspec.Struct, frozen=True, kw_only=True):
    """What a shadow came to."""

    n_compared: int
    """Ticks."""
    n_begun: int
    """How often it began anew."""
    worst_q_rad: tuple[float, ...]
    worst_tcp_m: float
    n_other_inputs: int
    """Ticks at which an input was not the twin's."""
    causes: tuple[str, ...]
    """What the last seconds look like, in words."""
    latched: str
    """The bound that was passed, in words; empty where none was."""
    latched_causes: tuple[str, ...] = ()
    """What it looked like then."""


def told_of(beside: "TwinBeside", worst: Worst) -> ShadowTold:
    """Return what it came to."""
    latched = beside.latched
    then = () if latched is None else latched.causes
    return ShadowTold(
        n_compared=beside.n_compared, n_begun=beside.n_begun, worst_q_rad=tuple(worst.q_rad), worst_tcp_m=worst.tcp_m,
        n_other_inputs=worst.n_other_inputs, causes=_texts(beside.causes),
        latched="" if latched is None else latched.text, latched_causes=_texts(then),
    )  # fmt: skip


def lines(told: ShadowTold) -> list[str]:
    """Return it in words."""
    worst = ", ".join(f"{joint} {1e3 * q:.2f}" for joint, q in zip(JOINTS, told.worst_q_rad, strict=True))
    said = [
        f"{told.n_compared} ticks compared, begun {told.n_begun} times; joints at most (mrad): {worst}; the tool "
        f"{1e3 * told.worst_tcp_m:.2f} mm; inputs not the twin's at {told.n_other_inputs} ticks",
        *(f"it looks as if {cause}" for cause in told.causes),
    ]
    if told.latched:
        said.append(f"latched: {told.latched}")
    return said


def table_of(beside: "TwinBeside", worst: Worst) -> Table:
    """Return how it is now."""
    table = Table("plant less twin", "now", "at most", title=f"shadow: {beside.n_compared} ticks compared")
    apart = beside.apart
    for i, joint in enumerate(JOINTS):
        now = "–" if apart is None else f"{1e3 * apart.q_rad[i]:+.2f} mrad"
        table.add_row(joint, now, f"{1e3 * worst.q_rad[i]:.2f} mrad")
    table.add_row("tool", "–" if apart is None else f"{1e3 * _length(apart):.2f} mm", f"{1e3 * worst.tcp_m:.2f} mm")
    inputs = "–" if apart is None or apart.inputs is None else f"{apart.inputs:#06b}"
    table.add_row("inputs that differ", inputs, f"at {worst.n_other_inputs} ticks")
    for cause in beside.causes:
        table.add_row("it looks as if", cause.text, "")
    return table


def _texts(causes: tuple[Cause, ...]) -> tuple[str, ...]:
    return tuple(cause.text for cause in causes)


def _length(apart: "Apart") -> float:
    return sum(x * x for x in apart.tcp_m) ** 0.5
