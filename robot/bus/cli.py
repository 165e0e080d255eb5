"""`autotelic bus`: look at a running rig's bus, or say stop on it. Writes nothing else. The edge."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from time import monotonic, sleep
from typing import Annotated, Any, NoReturn

import msgspec
import typer
from rich.console import Console

from config.loader import load_rig
from robot.bus.codec import Codec
from robot.bus.inlet import Received
from robot.bus.session import Bus
from robot.bus.telling import delay_line, rate_line, seen_tables
from robot.bus.topic import Role, Topic
from robot.bus.topics import TOPICS
from robot.bus.watch import Listener, ping_all, survey
from robot.errors import RobotConfigError

__all__ = ["app"]

TELL_S, PING_PAUSE_S, POLL_S = 1.0, 0.5, 0.1

app = typer.Typer(no_args_is_help=True, help="Look at the messages between a rig's processes, while it runs.")

RigOption = Annotated[str, typer.Option("--rig", help="Shipped rig or a file: whose bus it is.")]
BusOption = Annotated[str, typer.Option("--bus", help="Its endpoint, where it is another than the rig's.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON, one object a line.")]
SecondsOption = Annotated[float, typer.Option("--seconds", min=0.0, help="How long; 0 until Ctrl-C.")]
TopicArgument = Annotated[str, typer.Argument(help="Its name in the table; `autotelic bus list` prints it.")]


@app.command(name="list")
def show(
    rig: RigOption = "virtual_lab",
    bus: BusOption = "",
    seconds: Annotated[float, typer.Option("--seconds", min=0.1, help="How long to listen.")] = 1.5,
    *,
    json: JsonOption = False,
) -> None:
    """List processes and topics: who is there, who writes what how often, and what went wrong.

    Exit code 1 if a message came that is none of its topic's type.
    """
    with _joined(rig, bus) as joined:
        seen = survey(joined, seconds=seconds)
    if json:
        typer.echo(msgspec.json.encode(seen).decode())
    else:
        console = Console()
        for table in seen_tables(seen):
            console.print(table)
    if any(row.counts.malformed or row.counts.other_schema for row in seen.topics):
        raise typer.Exit(1)


@app.command()
def echo(
    topic: TopicArgument,
    rig: RigOption = "virtual_lab",
    bus: BusOption = "",
    number: Annotated[int, typer.Option("-n", "--number", min=0, help="How many messages; 0 until Ctrl-C.")] = 0,
    seconds: SecondsOption = 0.0,
    *,
    json: JsonOption = False,
) -> None:
    """Print messages as they come. Exit code 1 if none did."""
    row = _row(topic)
    codec = Codec(row.kind)
    came: SimpleQueue[Received[msgspec.Struct]] = SimpleQueue()
    n, end_s = 0, monotonic() + seconds
    with _joined(rig, bus) as joined, _until_interrupted():
        subscriber = joined.subscriber(row, came.put)
        told = ""
        while (not number or n < number) and (not seconds or monotonic() < end_s):
            told = _tell_error(str(subscriber.error or ""), told)
            try:
                received = came.get(timeout=POLL_S)
            except Empty:
                continue
            n += 1
            typer.echo(_text_of(received, codec, is_json=json))
    if not n:
        _nothing_came(topic)


@app.command()
def rate(
    topic: TopicArgument, rig: RigOption = "virtual_lab", bus: BusOption = "", seconds: SecondsOption = 0.0
) -> None:
    """Tell how often messages come, how evenly, and what was lost, once a second. Exit code 1 if none came."""
    _follow(topic, rig, bus, seconds, rate_line)


@app.command()
def delay(
    topic: TopicArgument, rig: RigOption = "virtual_lab", bus: BusOption = "", seconds: SecondsOption = 0.0
) -> None:
    """Tell how old messages are when they come, once a second. Exit code 1 if none came."""
    _follow(topic, rig, bus, seconds, delay_line)


@app.command()
def ping(
    rig: RigOption = "virtual_lab",
    bus: BusOption = "",
    number: Annotated[int, typer.Option("-n", "--number", min=1, help="How many times.")] = 4,
    *,
    json: JsonOption = False,
) -> None:
    """Ask every process on the bus whether it is there, and tell how long its answer took. Exit code 1 if none was."""
    n_answers = 0
    with _joined(rig, bus) as joined, _until_interrupted():
        for k in range(number):
            if k:
                sleep(PING_PAUSE_S)
            answers = ping_all(joined)
            n_answers += len(answers)
            if json:
                typer.echo(msgspec.json.encode(answers).decode())
            else:
                for answer in answers:
                    off = f", its clock {answer.offset_ms:+.2f} ± {answer.offset_within_ms:.2f} ms from ours"
                    where = "this machine" if answer.is_same_clock else f"another machine{off}"
                    typer.echo(
                        f"{answer.source} ({answer.role}, {where}): {answer.round_trip_ms:.2f} ms there and back"
                    )
    if not n_answers:
        _nothing_came("bus/ping")


@app.command()
def stop(
    rig: RigOption = "virtual_lab",
    bus: BusOption = "",
    seconds: Annotated[float, typer.Option(min=0.1, help="How long to say it at most.")] = 5.0,
) -> None:
    """Stop the arm that a robot node holds: said until it is confirmed. Exit code 1 if nobody confirms it."""
    from robot.node.stop_caller import StopCaller  # stands on this room

    with _joined(rig, bus) as joined:
        caller = StopCaller(joined, by="autotelic bus stop")
        took_s = caller.stop(within_s=seconds)
        caller.close()
    if took_s is None:
        typer.echo(f"error: stop: nobody confirmed it within {seconds:g} s: look at the arm", err=True)
        raise typer.Exit(1)
    typer.echo(f"stopped, confirmed after {1e3 * took_s:.0f} ms")


def _follow(topic: str, rig: str, bus: str, seconds: float, line: Callable[[Listener[msgspec.Struct]], str]) -> None:
    row, end_s = _row(topic), monotonic() + seconds
    with _joined(rig, bus) as joined:
        listener = Listener(joined, row)
        told = ""
        with _until_interrupted():
            while not seconds or monotonic() < end_s:
                sleep(min(TELL_S, max(end_s - monotonic(), 0.0)) if seconds else TELL_S)
                told = _tell_error(listener.error, told)
                typer.echo(line(listener))
    if not listener.pace.n:
        _nothing_came(topic)


@contextmanager
def _joined(rig_name: str, endpoint: str) -> Iterator[Bus]:
    rig = load_rig(rig_name)
    where, serial = endpoint or rig.bus or "", rig.expected.serial
    if not where:
        raise RobotConfigError(f"rig {rig.name}: expected a bus, it has none: its processes are one")
    if not serial:
        raise RobotConfigError(f"rig {rig.name}: expected expected.serial, not filled in yet: topics are below it")
    with Bus(where, serial=serial, role=Role.VIEWER, keys=rig.keys) as joined:
        yield joined


@contextmanager
def _until_interrupted() -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        typer.echo(err=True)


def _row(name: str) -> Topic[Any]:
    for row in TOPICS:
        if row.name == name:
            return row
    raise typer.BadParameter(f"expected one of {', '.join(row.name for row in TOPICS)}, got {name}", param_hint="TOPIC")


def _text_of(received: Received[msgspec.Struct], codec: Codec[msgspec.Struct], *, is_json: bool) -> str:
    """Return a message in one line; numbers that are not finite are in words, a field of bytes is left out."""
    encoded, envelope = codec.encode(received.message), received.envelope
    text = encoded.beside or encoded.payload
    age_ms = None if received.age_ns is None else received.age_ns / 1e6
    if is_json:
        whole = {
            "source": envelope.source, "sequence": envelope.sequence, "stamp_ns": envelope.stamp_ns, "age_ms": age_ms,
            "message": msgspec.Raw(text),
        }  # fmt: skip
        return msgspec.json.encode(whole).decode()
    age = "age unknown (another machine's clock)" if age_ms is None else f"{age_ms:.2f} ms old"
    return f"{envelope.source} {envelope.sequence}, {age}: {text.decode()}"


def _tell_error(error: str, told: str) -> str:
    """Print an error that was not told yet and return what was."""
    if error and error != told:
        typer.echo(f"error: {error}", err=True)
        return error
    return told


def _nothing_came(name: str) -> NoReturn:
    typer.echo(f"error: {name}: expected something, nothing came; does the process that writes it run?", err=True)
    raise typer.Exit(1)
