"""What a driver sees in the terminal: state, speed, force, what limits and by how much, and why nothing moves."""

import math
from collections.abc import Callable
from types import TracebackType
from typing import Self

from rich.console import Console, Group
from rich.live import Live
from rich.table import Table
from rich.text import Text

from robot.messages import ArmState, Intent, StationMode, Twist, Vec3
from robot.teleop.driver import DriveView
from robot.teleop.meanings import meaning

__all__ = ["ReadOut", "kept_share", "picture"]

SHOWN_HZ = 10
MM = 1e3
COLOURS = {
    StationMode.DISARMED: "white",
    StationMode.ARMED: "yellow",
    StationMode.ENGAGED: "green",
    StationMode.LATCHED: "bold red",
}


class ReadOut:
    """Shows views in place, some ten times a second; a terminal that is none gets a line for each change of state.

    Args:
        keys: what does what.
        console: where to.
        now_ns: the wall's time, for the rate alone.
    """

    def __init__(self, *, keys: tuple[tuple[str, str], ...], console: Console, now_ns: Callable[[], int]) -> None:
        self._keys, self._console, self._now_ns = keys, console, now_ns
        self._live: Live | None = None
        self._shown_ns = 0
        self._said = ""

    def __enter__(self) -> Self:
        self._begin()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.pause()

    def __call__(self, view: DriveView) -> None:
        """Show a view, if one is due."""
        if self._live is None:
            self._say(view)
            return
        now_ns = self._now_ns()
        if now_ns - self._shown_ns >= 1e9 / SHOWN_HZ:
            self._shown_ns = now_ns
            self._live.update(picture(view, self._keys), refresh=True)

    def pause(self) -> None:
        """Leave the terminal to somebody who types. Idempotent."""
        if self._live is not None:
            self._live.stop()
            self._live = None

    def go_on(self) -> None:
        """Show again after a pause."""
        self._begin()

    def _begin(self) -> None:
        if self._console.is_terminal and self._live is None:
            self._live = Live(console=self._console, auto_refresh=False, transient=False)
            self._live.start()

    def _say(self, view: DriveView) -> None:
        said = f"{view.state.mode}{f': {view.state.reason}' if view.state.reason else ''}"
        if said != self._said:
            self._said = said
            self._console.print(said, highlight=False, markup=False)


def picture(view: DriveView, keys: tuple[tuple[str, str], ...]) -> Group:
    """Return what is shown of a view."""
    table = Table.grid(padding=(0, 2))
    table.add_column(style="dim", no_wrap=True)
    table.add_column()
    for name, value in _rows(view):
        table.add_row(name, value)
    help_line = Text("  ".join(f"{key} {what}" for key, what in keys), style="dim")
    return Group(table, help_line)


def _rows(view: DriveView) -> list[tuple[str, Text]]:
    state, asked = view.state, view.asked
    who = f"  {state.source}, profile {state.profile}" if state.source else ""
    reason = f"  {state.reason}" if state.reason else ""
    return [
        ("state", Text(f"{state.mode}{who}{reason}", style=COLOURS[state.mode])),
        ("drive", _drive(view)),
        ("speed", Text(f"{_speed(view)}   share {asked.speed_share:.0%}   frame {asked.frame}")),
        ("force", Text(f"{math.hypot(*view.measured.tcp_force_n):5.1f} N   hand {_hand(view.measured)}")),
        ("limits", _limits(view)),
        ("age", Text(f"{view.age_s * MM:4.0f} ms of the device, {view.n_steps} steps")),
    ]


def _drive(view: DriveView) -> Text:
    if view.refused is not None:
        return Text(f"preview: not sent, {view.refused.reason}: {view.refused.detail}", style="bold yellow")
    if view.resting:
        return Text(f"rests: {view.resting}", style="cyan")
    return Text("moves" if view.gain >= 1.0 else f"moves, ramp {view.gain:.0%}", style="green")


def _speed(view: DriveView) -> str:
    moved = (0.0, 0.0, 0.0) if view.result is None else view.result.executed.moved_m
    return f"{math.hypot(*moved) / view.step_s * MM:4.0f} mm/s"


def _hand(state: ArmState) -> str:
    doing = "holds" if state.grip.has_object else "moves" if state.grip.is_moving else "open"
    return f"{doing} {state.grip.opening_m * MM:.0f} mm"


def _limits(view: DriveView) -> Text:
    if view.result is None or not view.result.executed.limiters:
        return Text("none", style="dim")
    names = view.result.executed.limiters
    amounts = {limited.name: limited.amount for limited in view.result.executed.limited if limited.amount}
    kept = kept_share(view.sent, view.result.executed.moved_m, view.step_s)
    share = "" if kept is None or view.gain < 1.0 else f"  (the tool goes at {kept:.0%} of what was asked)"
    told = [f"{name}{f' {amounts[name]:.3g}' if name in amounts else ''}: {meaning(name)}" for name in names]
    return Text("; ".join(told) + share, style="yellow")


def kept_share(asked: Intent, moved_m: Vec3, step_s: float) -> float | None:
    """Return how much of the asked speed was carried out along its own direction; None where none was asked."""
    if not isinstance(asked, Twist):
        return None
    speed = math.hypot(*asked.linear_m_s)
    if speed <= 0.0:
        return None
    along = sum(a * b for a, b in zip(asked.linear_m_s, moved_m, strict=True)) / speed
    return along / (speed * step_s)
