"""The bus bench: one way beside zenoh-python alone and pyzmq, message by message; messages lost at 500 Hz."""

import os
import socket
import subprocess
import sys
from contextlib import ExitStack
from importlib.util import find_spec
from pathlib import Path
from time import perf_counter

import msgspec
from rich.console import Console
from rich.progress import track

from robot.bench import BenchReport, BenchResult, bench_report
from robot.bus.bench_blocks import Job, Listening, listen
from robot.bus.bench_idle import idle_rows
from robot.bus.errors import BusError
from robot.bus.pace import spread_of

__all__ = ["bench_bus"]

N_SKIPPED = 20
"""First messages that are not judged: links and memory are still being made ready."""
PERIOD_NS_BY_SIZE = {"small": 10_000_000, "kib": 10_000_000, "frame": 60_000_000}
N_BY_SIZE = {"small": 600, "kib": 600, "frame": 120}
N_FULL_FACTOR = 10
LABEL_BY_SIZE = {"small": "64b", "kib": "1kb", "frame": "frame"}
RATIO_GOAL = 1.3
LOSS_PERIOD_NS = 2_000_000
N_LOSS, N_LOSS_FULL = 5_000, 1_000_000
START_S, NS_PER_S = 30.0, 1e9


def bench_bus(*, full: bool) -> BenchReport:
    """Time messages of 64 B, 1 kB and 0.9 MB one way, and count what is lost at 500 Hz.

    Over each transport five thousand messages are counted, 10 s. With full ten times as many are timed, a million
    counted, which takes 2000 s, and an idle rig's processors are looked at.
    """
    begin = perf_counter()
    transports = ("ours", "raw", *(("zmq",) if find_spec("zmq") else ()))
    rows = []
    for size in track(PERIOD_NS_BY_SIZE, "bus", console=Console(stderr=True), transient=True, auto_refresh=False):
        n = N_BY_SIZE[size] * (N_FULL_FACTOR if full else 1)
        heard = _run(size, transports, n=n, period_ns=PERIOD_NS_BY_SIZE[size])
        rows += _size_rows(size, {name: listening.ages_ns[N_SKIPPED:] for name, listening in heard.items()})
    rows += _loss_rows(transports, N_LOSS_FULL if full else N_LOSS)
    if full:
        rows += idle_rows()
    return bench_report("bus", tuple(rows), seconds=perf_counter() - begin)


def _size_rows(size: str, ages_ns: dict[str, list[int]]) -> list[BenchResult]:
    rows, p50_us = [], {}
    label = LABEL_BY_SIZE[size]
    for transport, ages in ages_ns.items():
        spread = spread_of(ages)
        if spread is None:
            raise BusError(f"bench bus: expected messages over {transport}, none came")
        p50_us[transport] = 1e3 * spread.p50_ms
        prefix = "" if transport == "ours" else f"{transport}_"
        rows += [
            BenchResult(name=f"{prefix}one_way_p50_us_{label}", value=1e3 * spread.p50_ms, unit="us"),
            BenchResult(name=f"{prefix}one_way_p99_us_{label}", value=1e3 * spread.p99_ms, unit="us"),
            BenchResult(name=f"{prefix}came_{label}", value=float(spread.n), unit="1"),
        ]
    ratio = p50_us["ours"] / p50_us["raw"]
    rows.append(
        BenchResult(
            name=f"raw_ratio_{label}", value=ratio, unit="1", goal=f"<= {RATIO_GOAL:g}", ok=ratio <= RATIO_GOAL
        )
    )  # fmt: skip
    return rows


def _loss_rows(transports: tuple[str, ...], n: int) -> tuple[BenchResult, ...]:
    """Return what was lost of so many over each: by the number that were written, and as our bus itself tells."""
    heard = _run("small", transports, n=n, period_ns=LOSS_PERIOD_NS)
    ours, rows = heard["ours"], []
    n_lost, n_told = n - len(ours.ages_ns), ours.n_lost() or 0
    of = {"of": f"{n} at {NS_PER_S / LOSS_PERIOD_NS:g} Hz"}
    rows.append(
        BenchResult(
            name="lost", value=float(n_lost), unit="1", goal="= 0, or told by the bus", ok=n_lost == n_told,
            details=of | {"told by the bus": str(n_told)},
        )
    )  # fmt: skip
    for transport, listening in heard.items():
        spread, prefix = spread_of(listening.ages_ns), "" if transport == "ours" else f"{transport}_"
        if prefix:
            n_gone = float(n - len(listening.ages_ns))
            rows.append(BenchResult(name=f"{prefix}lost", value=n_gone, unit="1", details=of))
        p99_us = 0.0 if spread is None else 1e3 * spread.p99_ms
        rows.append(BenchResult(name=f"{prefix}one_way_p99_us_64b_500hz", value=p99_us, unit="us"))
    return tuple(rows)


def _run(size: str, transports: tuple[str, ...], *, n: int, period_ns: int) -> dict[str, Listening]:
    """Listen here while a process of its own writes, and return what came by transport."""
    with ExitStack() as listenings:
        job = Job(size=size, endpoints={name: _endpoint() for name in transports}, n=n, period_ns=period_ns)
        heard = {}
        for name, endpoint in job.endpoints.items():
            heard[name] = listen(name, size, endpoint)
            listenings.callback(heard[name].close)
        writer = subprocess.run(
            [sys.executable, "-m", "robot.bus.bench_blocks"], input=msgspec.json.encode(job) + b"\n", check=False,
            cwd=Path(__file__).parents[2], timeout=START_S + 3 * n * period_ns / NS_PER_S,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        )  # fmt: skip
        if writer.returncode:
            raise BusError(f"bench bus: expected the writer to end, got: {writer.stderr.decode()[-500:]}")
    return heard


def _endpoint() -> str:
    """Return an endpoint that nobody has, on a loopback address that only a process of this number takes."""
    pid = os.getpid()
    host = f"127.{24 + (pid >> 15) % 8}.{pid >> 7 & 0xFF}.{1 + (pid & 0x7F)}"
    with socket.create_server((host, 0)) as free:
        return f"tcp/{host}:{free.getsockname()[1]}"
