"""One-way times over three transports, from a process of its own: through this bus, zenoh-python alone, and pyzmq.

The other process writes and this one reads, on one machine, so that one clock judges both ends. Each message tells when
its writer began to make it; ours are Structs, the others' bytes that were there before.
"""

import sys
from collections.abc import Callable
from contextlib import ExitStack
from struct import Struct as Form
from threading import Thread
from time import monotonic_ns, sleep
from typing import Any

import msgspec
import numpy as np
import zenoh

from robot.bus.link import on_link, open_link
from robot.bus.session import Bus
from robot.bus.topic import Role, Topic

__all__ = ["FRAME", "KIB", "SERIAL", "SMALL", "Job", "Listening", "listen", "main"]

SERIAL = "bench"
RAW_KEY = "bench/raw"
WIDTH, HEIGHT = 640, 480
LINGER_S, JOIN_S = 0.3, 0.5
_STAMP = Form("<q")
_END = b"end"
_Writer = tuple[Callable[[], object], Callable[[], None]]
"""Writes one message; closes."""


class Small(msgspec.Struct, frozen=True, kw_only=True):
    """64 bytes of JSON, or about."""

    values: tuple[float, ...]
    flags: int


class Frame(msgspec.Struct, frozen=True, kw_only=True):
    """A picture."""

    width: int
    height: int
    pixels: bytes


SMALL = Topic(name="bench/small", kind=Small, writers=(Role.TWIN,))
KIB = Topic(name="bench/kib", kind=Small, writers=(Role.TWIN,))
FRAME = Topic(name="bench/frame", kind=Frame, writers=(Role.TWIN,), is_shared_memory=True)
_TOPICS: dict[str, Topic[Any]] = {"small": SMALL, "kib": KIB, "frame": FRAME}
_MESSAGES: dict[str, Callable[[], msgspec.Struct]] = {
    "small": lambda: Small(values=(0.123456, -1.234567, 2.345678, 0.654321), flags=255),
    "kib": lambda: Small(values=(0.1234567,) * 100, flags=255),
    "frame": lambda: Frame(width=WIDTH, height=HEIGHT, pixels=bytes(WIDTH * HEIGHT * 3)),
}


class Job(msgspec.Struct, frozen=True, kw_only=True):
    """What the other process is to write."""

    size: str
    endpoints: dict[str, str]
    """Where each transport's reader listens. The transports take turns, message by message, so that what else the
    machine does meets all of them alike; in an order that is drawn anew each time, for who comes right after another
    one that is built like it finds its code in the caches."""
    n: int
    """Of messages over each."""
    period_ns: int
    """Between two messages over one of them."""


class Listening:
    """What came of one job.

    Attributes:
        ages_ns: Of each message, from when its writer began to make it until it was read.
        close: Listens no more.
        n_lost: How many the bus itself missed; None where the transport does not number its messages.
    """

    def __init__(self) -> None:
        self.ages_ns: list[int] = []
        self.close: Callable[[], None] = lambda: None
        self.n_lost: Callable[[], int | None] = lambda: None

    def note(self, stamp_ns: int) -> None:
        """Take note of a message that was begun then."""
        self.ages_ns.append(monotonic_ns() - stamp_ns)


def listen(transport: str, size: str, endpoint: str) -> Listening:
    """Listen as the hub and return what comes."""
    heard = Listening()
    if transport == "ours":
        bus = Bus(endpoint, serial=SERIAL, role=Role.VIEWER, is_hub=True)
        bus.open()
        subscriber = bus.subscriber(_TOPICS[size], lambda received: heard.note(received.envelope.stamp_ns))
        heard.close, heard.n_lost = bus.close, lambda: subscriber.counts.lost
    else:
        heard.close = (_listen_raw if transport == "raw" else _listen_zmq)(endpoint, heard)
    return heard


def main() -> None:
    """Write what one line of JSON on standard input asks for."""
    job = msgspec.json.decode(sys.stdin.readline(), type=Job)
    with ExitStack() as open_writers:
        puts = []
        for transport, endpoint in job.endpoints.items():
            put, close = _writer_of(transport, job.size, endpoint)
            open_writers.callback(close)
            puts.append(put)
        sleep(JOIN_S)
        due_ns, rng = monotonic_ns(), np.random.default_rng(0)
        for _ in range(job.n):
            for k in rng.permutation(len(puts)).tolist():
                puts[k]()
                due_ns += job.period_ns // len(puts)
                sleep(max(due_ns - monotonic_ns(), 0) * 1e-9)
        sleep(LINGER_S)


def _writer_of(transport: str, size: str, endpoint: str) -> _Writer:
    message = _MESSAGES[size]()
    if transport == "ours":
        bus = Bus(endpoint, serial=SERIAL, role=Role.TWIN)
        bus.open()
        publisher = bus.publisher(_TOPICS[size])
        return lambda: publisher.put(message), bus.close  # stamped before it is encoded
    body = message.pixels if isinstance(message, Frame) else msgspec.json.encode(message)
    return (_raw_writer if transport == "raw" else _zmq_writer)(endpoint, body)


def _listen_raw(endpoint: str, heard: Listening) -> Callable[[], None]:
    session = open_link(endpoint, is_hub=True, is_by_size=True)

    def take(sample: zenoh.Sample) -> None:
        sample.payload.to_bytes()
        assert sample.attachment is not None, "the writer's stamp"
        heard.note(_STAMP.unpack(sample.attachment.to_bytes())[0])

    session.declare_subscriber(RAW_KEY, on_link(take))
    return session.close


def _raw_writer(endpoint: str, body: bytes) -> _Writer:
    session = open_link(endpoint, is_hub=False, is_by_size=True)
    publisher = session.declare_publisher(RAW_KEY, congestion_control=zenoh.CongestionControl.DROP, express=True)
    return lambda: publisher.put(body, attachment=_STAMP.pack(monotonic_ns())), session.close


def _listen_zmq(endpoint: str, heard: Listening) -> Callable[[], None]:
    import zmq

    context = zmq.Context()
    socket = context.socket(zmq.SUB)
    socket.setsockopt(zmq.SUBSCRIBE, b"")
    socket.bind(_zmq_endpoint(endpoint))

    def read() -> None:
        while True:
            try:
                stamp, _ = socket.recv_multipart()
            except zmq.ZMQError:
                return
            if stamp == _END:
                return
            heard.note(_STAMP.unpack(stamp)[0])

    reader = Thread(target=read, name="zmq", daemon=True)
    reader.start()

    def close() -> None:
        reader.join(JOIN_S)
        socket.close(linger=0)
        context.term()

    return close


def _zmq_writer(endpoint: str, body: bytes) -> _Writer:
    import zmq

    context = zmq.Context()
    socket = context.socket(zmq.PUB)
    socket.connect(_zmq_endpoint(endpoint))

    def close() -> None:
        socket.send_multipart((_END, b""))
        socket.close(linger=1000)
        context.term()

    return lambda: socket.send_multipart((_STAMP.pack(monotonic_ns()), body)), close


def _zmq_endpoint(endpoint: str) -> str:
    return endpoint.replace("tcp/", "tcp://")


if __name__ == "__main__":
    main()
