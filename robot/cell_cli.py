"""`autotelic cell`: walk through a cell's wires with a person, or with the truth of a virtual table. The edge."""

import os
import signal
import stat
import sys
import time
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from types import FrameType
from typing import TYPE_CHECKING, Annotated

import msgspec
import typer
from rich.console import Console
from rich.table import Table

from config.cell import CellConfig
from config.loader import resolve
from config.resolved import Resolved
from config.rig import Rig
from config.scenario import Scenario
from robot.cell_check import Finding, Somebody, Wire, check_cell_wires
from robot.errors import RobotConfigError
from robot.hal.pins import straight_cell
from robot.hal.ur_checks import check_serial
from robot.hal.ur_state import kind_of_address
from robot.rigs import check_usable

__all__ = ["app"]

if TYPE_CHECKING:
    from robot.hal.ur_terminals import UrTerminals

PATIENCE_S, POLL_S = 20.0, 0.02
ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

app = typer.Typer(no_args_is_help=True, help="The table's wiring at the control box.")


@app.callback()
def _root() -> None:
    """Keep `test` a sub-command, though it is the only one."""


@app.command(name="test")
def walk(
    rig: Annotated[str, typer.Option(help="Shipped rig or a file; its cell says what is wired where.")] = "virtual_lab",
    scenario: Annotated[str, typer.Option(help="Shipped scenario or a file, for what the signals are.")] = "paper",
    *,
    auto: Annotated[
        bool, typer.Option("--auto", help="Virtual controller only: its truth presses and looks, nobody is asked.")
    ] = False,
    json: Annotated[bool, typer.Option("--json", help="Print the findings as one JSON object.")] = False,
) -> None:
    """Press every button, switch every lamp and lid, and tell which wires are right. The arm never moves.

    Outputs return to what they were; a drive with two coils is left switched off. Exit code 1 if a wire is wrong.
    """
    resolved = resolve(rig=rig, scenario=scenario)
    findings = _walk(resolved, is_auto=auto)
    if json:
        typer.echo(msgspec.json.encode({"findings": findings}).decode())
    else:
        Console().print(_table(findings))
    if not all(finding.ok for finding in findings):
        raise typer.Exit(1)


def _walk(resolved: Resolved, *, is_auto: bool) -> list[Finding]:
    from robot.hal.ur_terminals import UrTerminals  # brings ur_rtde, which not every installation has

    rig, cell = resolved.rig, resolved.cell or straight_cell()
    check_usable(rig)
    if rig.address is None:
        raise RobotConfigError(f"rig {rig.name}: expected an arm with a control box at an address, it has none")
    kind = kind_of_address(rig.address).value
    if kind != rig.expected.kind:
        raise RobotConfigError(
            f"rig {rig.name}: expected.kind is {rig.expected.kind}, at {rig.address} there can only be a {kind} arm: "
            "on this machine's loopback there are virtual controllers, anywhere else real ones"
        )
    with ExitStack() as stack:
        somebody = stack.enter_context(_truth_of(rig)) if is_auto else _person()
        terminals = stack.enter_context(_restoring(UrTerminals(rig.address)))
        check_serial(terminals.serial, rig.expected.serial, rig.address)
        inputs, outputs = wires_of(resolved.scenario, cell)
        if is_auto and cell.arming_signal is not None:
            typer.echo("the arming button is left out: a virtual table has nobody to press it", err=True)
        else:
            inputs += arming_wires(cell)
        return check_cell_wires(
            cell=cell,
            inputs=inputs,
            outputs=outputs,
            terminals=terminals,
            somebody=somebody,
            now_ns=time.monotonic_ns,
            wait_s=time.sleep,
        )


@contextmanager
def _restoring(terminals: "UrTerminals") -> "Generator[UrTerminals]":
    """Enter the terminals; however the walk ends, a signal too, they are left as they were, and it is said if so.

    Raises:
        typer.Exit: a signal ended it, once the outputs are restored.
    """
    with _raising_signals():
        try:
            with terminals:
                yield terminals
        except _Ended as ended:
            _tell(f"ended by {ended.number.name}: {_how_left(terminals)}")
            raise typer.Exit(128 + ended.number) from None
        except BaseException:
            if terminals.is_switched:
                _tell(_how_left(terminals))
            raise


def _how_left(terminals: "UrTerminals") -> str:
    if not terminals.is_switched:
        return "nothing was switched"
    if terminals.is_restored:
        return "the outputs are as they were"
    return (
        "NOT CONFIRMED that the outputs are as they were: look at the lamps and lids, and see that no coil has current"
    )


def _tell(text: str) -> None:
    with suppress(OSError):  # the terminal may be what has gone
        typer.echo(text, err=True)


class _Ended(BaseException):
    """A signal asks the walk to end."""

    def __init__(self, number: signal.Signals) -> None:
        super().__init__(number)
        self.number = number


@contextmanager
def _raising_signals() -> Generator[None]:
    """Turn the first signal that asks for an end into an exception; later ones wait for what it makes unwind."""

    def hear(number: int, frame: FrameType | None) -> None:  # noqa: ARG001
        for each in ENDING:
            signal.signal(each, signal.SIG_IGN)
        raise _Ended(signal.Signals(number))

    before = {number: signal.signal(number, hear) for number in ENDING}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def arming_wires(cell: CellConfig) -> tuple[Wire, ...]:
    """Return the wire of the button that arms, where a cell has one."""
    return tuple(
        Wire(signal=w.signal, name="arming", what="button", pin=w.pin, inverted=w.inverted)
        for w in cell.inputs
        if w.signal == cell.arming_signal
    )


def wires_of(scenario: Scenario, cell: CellConfig) -> tuple[tuple[Wire, ...], tuple[Wire, ...]]:
    """Return the input and output wires that a scenario's table has in a cell."""
    sensed = {b.input: (b.name, "button") for b in scenario.buttons}
    sensed |= {b.presence_input: (b.name, "sensor") for b in scenario.boxes if b.presence_input is not None}
    driven = {b.lamp_output: (b.name, "lamp") for b in scenario.buttons}
    driven |= {b.lid.output: (b.name, "lid") for b in scenario.boxes if b.lid is not None}
    inputs = tuple(
        Wire(signal=w.signal, name=sensed[w.signal][0], what=sensed[w.signal][1], pin=w.pin, inverted=w.inverted)
        for w in cell.inputs
        if w.signal in sensed
    )
    outputs = tuple(
        Wire(signal=w.signal, name=driven[w.signal][0], what=driven[w.signal][1], pin=w.pin, inverted=w.inverted)
        for w in cell.outputs
        if w.signal in driven
    )
    return inputs, outputs


def _person() -> Somebody:
    """Return whoever answers on standard input.

    Raises:
        RobotConfigError: nobody can.
    """
    if sys.stdin.isatty() or not stat.S_ISCHR(os.fstat(sys.stdin.fileno()).st_mode):
        return _Person()
    raise RobotConfigError(
        "cell test: expected a person at a terminal, who presses and looks; standard input is none (of a virtual "
        "controller --auto asks its truth instead)"
    )


class _Person(Somebody):
    """Asks whoever sits at the terminal."""

    def press(self, wire: Wire, is_changed: Callable[[], bool]) -> None:
        what = "press and hold" if wire.what == "button" else "put a cylinder into"
        self._await(f"{what} {wire.label}", is_changed)

    def release(self, wire: Wire, is_back: Callable[[], bool]) -> None:
        self._await(f"let go of {wire.label}" if wire.what == "button" else f"empty {wire.label} again", is_back)

    def ready(self, wire: Wire) -> None:
        hands = "; keep your hands out of it" if wire.what == "lid" else ""
        typer.prompt(f"Enter switches {wire.label}{hands}", default="", show_default=False, err=True)

    def saw(self, wire: Wire, *, is_on: bool) -> bool:
        words = {"lamp": ("lit", "dark"), "lid": ("open", "shut")}[wire.what]
        return typer.confirm(f"is the {wire.name} {wire.what} {words[0] if is_on else words[1]} now?", err=True)

    @staticmethod
    def _await(text: str, is_there: Callable[[], bool]) -> None:
        typer.echo(f"{text} ... ", nl=False, err=True)
        end_s = time.monotonic() + PATIENCE_S
        while time.monotonic() < end_s and not is_there():
            time.sleep(POLL_S)
        typer.echo("seen" if is_there() else f"nothing within {PATIENCE_S:g} s", err=True)


def _truth_of(rig: Rig) -> "AbstractContextManager[Somebody]":
    """Return who acts at a virtual table.

    Raises:
        RobotConfigError: the rig's arm is a real one, or its bus is not named.
    """
    if rig.expected.kind != "virtual" or rig.bus is None:
        raise RobotConfigError(
            f"rig {rig.name}: --auto is for a virtual controller with a bus; at a real table a person presses and looks"
        )
    from robot.bus.virtual_table import VirtualSomebody  # brings the bus, which a person's walk does not need

    return VirtualSomebody(rig.bus, rig.expected.serial, keys=rig.keys)


def _table(findings: list[Finding]) -> Table:
    table = Table("wire", "terminal", "verdict", title="cell")
    for finding in findings:
        style = "green" if finding.ok else "bold red"
        table.add_row(f"{finding.name} {finding.what}", finding.pin, f"[{style}]{finding.verdict}[/{style}]")
    return table
