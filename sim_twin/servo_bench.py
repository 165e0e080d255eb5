"""The servo bench: the period, our own work in it, late ticks, the controller's ticks, and memory over time.

One run alternates between two clients of one virtual controller in a process of its own: this project's tick loop
(motion, cell, gate and backend) and a loop of ur_rtde's calls alone. Both are paced by the client library.
"""

import gc
import os
from pathlib import Path
from statistics import median
from time import perf_counter

import msgspec
import numpy as np
from msgspec.structs import replace
from rich.console import Console
from rich.progress import track

from config.loader import resolve
from robot.bench import BenchReport, BenchResult, bench_report
from robot.realtime import collect_rarely
from sim_twin.controller.process import ControllerProcess
from sim_twin.controller.server import Setup
from sim_twin.servo_blocks import PERIOD_S, Blocks

__all__ = ["bench_servo"]

SHORT_S, HOUR_S = 34.0, 3600.0
N_BLOCKS, SHORTEST_S, LONGEST_S, LONGEST_BARE_S = 8, 0.5, 60.0, 5.0
OWN_WORK_GOAL_US, LATE_GOAL, CONTROLLER_GOAL_MS = 150.0, 0.005, 1.0
SLOPE_GOAL_MB_H, SLOPE_FROM_S = 5.0, 300.0
"""A slope is that of a run's second half; over less time than this it is of caches that fill: told and not judged."""
N_FITTED, S_PER_H, MB = 3, 3600.0, 1e6


class _Block(msgspec.Struct, frozen=True, kw_only=True):
    """What is noted at the end of a block of ours."""

    at_s: float
    client_mb: float
    controller_mb: float
    tick_p50_ms: float
    tick_p99_ms: float
    n_missed: float


def bench_servo(*, full: bool, seconds: float | None = None) -> BenchReport:
    """Servo a virtual controller at 500 Hz; full takes an hour, seconds as long as it says."""
    begin = perf_counter()
    servo_s = seconds or (HOUR_S if full else SHORT_S)
    ours_s = min(max(servo_s / N_BLOCKS, SHORTEST_S), LONGEST_S)
    bare_s = min(ours_s, LONGEST_BARE_S)
    n_pairs = max(1, round(servo_s / (ours_s + bare_s)))
    host = _own_host()
    resolved = resolve(rig="virtual_lab")
    resolved = replace(resolved, rig=replace(resolved.rig, address=host))
    thresholds = gc.get_threshold()
    with ControllerProcess(Setup(host=host)) as process:
        blocks = Blocks(address=host, resolved=resolved)
        collect_rarely()  # as a servo process does
        cpu = blocks.cpu
        _keep_off(process, cpu.cpus)
        try:
            noted: list[_Block] = []
            # A bar that draws itself does so in a thread of this process, in the midst of the ticks that are timed.
            bar = track(range(n_pairs), "servo", console=Console(stderr=True), transient=True, auto_refresh=False)
            for _ in bar:
                blocks.run_bare(bare_s)
                before = _ticks(process, clear=True)
                blocks.run_ours(ours_s)
                noted.append(_note(process, at_s=perf_counter() - begin, n_missed_before=before["n_missed"]))
        finally:
            cpu.release()
            gc.unfreeze()
            gc.set_threshold(*thresholds)
            blocks.close()
    priority = BenchResult(
        name="realtime_priority", value=0.0 if cpu.why_not else resolved.rig.realtime_priority, unit="1",
        details={"not granted": cpu.why_not} if cpu.why_not else msgspec.UNSET,
    )  # fmt: skip
    results = (*_period_rows(blocks), priority, *_controller_rows(noted, ours_s=ours_s), *_memory_rows(noted))
    return bench_report("servo", results, seconds=perf_counter() - begin)


def _period_rows(blocks: Blocks) -> tuple[BenchResult, ...]:
    ours, bare, work = blocks.period, blocks.bare_period, blocks.own_work
    work_us = 1e6 * work.percentile_s(99.0)
    return (
        BenchResult(name="period_p50_ms", value=1e3 * ours.percentile_s(50.0), unit="ms"),
        BenchResult(name="period_p99_ms", value=1e3 * ours.percentile_s(99.0), unit="ms"),
        BenchResult(name="period_max_ms", value=1e3 * ours.percentile_s(100.0), unit="ms"),
        BenchResult(name="bare_period_p50_ms", value=1e3 * bare.percentile_s(50.0), unit="ms"),
        BenchResult(name="bare_period_p99_ms", value=1e3 * bare.percentile_s(99.0), unit="ms"),
        BenchResult(name="bare_call_p50_us", value=1e6 * blocks.bare_call.percentile_s(50.0), unit="us"),
        BenchResult(name="bare_call_p99_us", value=1e6 * blocks.bare_call.percentile_s(99.0), unit="us"),
        BenchResult(name="own_work_p50_us", value=1e6 * work.percentile_s(50.0), unit="us"),
        BenchResult(
            name="own_work_p99_us", value=work_us, unit="us", goal=f"<= {OWN_WORK_GOAL_US:g}",
            ok=0.0 < work_us <= OWN_WORK_GOAL_US,
        ),
        BenchResult(
            name="own_work_p99_us_in_a_median_second", unit="us",
            value=1e6 * median(blocks.own_work_p99_s or [0.0]),
        ),
        BenchResult(name="own_cpu_p50_us", value=1e6 * blocks.own_cpu.percentile_s(50.0), unit="us"),
        BenchResult(name="own_cpu_p99_us", value=1e6 * blocks.own_cpu.percentile_s(99.0), unit="us"),
        BenchResult(name="own_intent_cpu_p50_us", value=1e6 * blocks.intent_cpu.percentile_s(50.0), unit="us"),
        BenchResult(name="own_calm_p99_us", value=1e6 * blocks.calm_work.percentile_s(99.0), unit="us"),
        BenchResult(name="preempted_tick_share", value=1.0 - blocks.calm_work.n / max(1, work.n), unit="share"),
        BenchResult(
            name="late_tick_share", value=ours.over_share, unit="share", goal=f"<= {LATE_GOAL:g}",
            ok=ours.n > 0 and ours.over_share <= LATE_GOAL,
        ),
        BenchResult(name="bare_late_tick_share", value=bare.over_share, unit="share"),
        BenchResult(
            name="stops", value=float(len(blocks.stops)), unit="1", goal="= 0", ok=not blocks.stops,
            details={f"{i}": why for i, why in enumerate(blocks.stops, 1)} if blocks.stops else msgspec.UNSET,
        ),
        BenchResult(name="ticks", value=float(ours.n), unit="1"),
        BenchResult(name="servo_s", value=blocks.servo_s, unit="s"),
    )  # fmt: skip


def _controller_rows(noted: list[_Block], *, ours_s: float) -> tuple[BenchResult, ...]:
    """Return rows on the controller's ticks: medians over our blocks, of each its last 10 s at most."""
    p99_ms = median(block.tick_p99_ms for block in noted)
    missed = sum(block.n_missed for block in noted) * PERIOD_S / (ours_s * len(noted))
    return (
        BenchResult(name="controller_tick_p50_ms", value=median(block.tick_p50_ms for block in noted), unit="ms"),
        BenchResult(
            name="controller_tick_p99_ms", value=p99_ms, unit="ms", goal=f"<= {CONTROLLER_GOAL_MS:g}",
            ok=p99_ms <= CONTROLLER_GOAL_MS,
        ),
        BenchResult(name="controller_slot_missed_share", value=missed, unit="share"),
    )  # fmt: skip


def _memory_rows(noted: list[_Block]) -> tuple[BenchResult, ...]:
    """Return rows on resident memory, from the end of the first block of ours on: there everything has been used."""
    rows = []
    for who, sizes in (("client", [b.client_mb for b in noted]), ("controller", [b.controller_mb for b in noted])):
        half = len(noted) // 2 if len(noted) > N_FITTED else 0
        at_s = [block.at_s for block in noted[half:]]
        slope = float(np.polyfit(at_s, sizes[half:], 1)[0]) * S_PER_H if len(at_s) > 1 else 0.0
        is_judged = at_s[-1] - at_s[0] >= SLOPE_FROM_S
        goal = f"<= {SLOPE_GOAL_MB_H:g}" if is_judged else ""
        rows += [
            BenchResult(name=f"{who}_rss_start_mb", value=sizes[0], unit="MB"),
            BenchResult(name=f"{who}_rss_end_mb", value=sizes[-1], unit="MB"),
            BenchResult(
                name=f"{who}_rss_mb_per_h", value=slope, unit="MB/h", goal=goal,
                ok=not is_judged or slope <= SLOPE_GOAL_MB_H,
            ),
        ]  # fmt: skip
    return tuple(rows)


def _keep_off(process: ControllerProcess, cpus: set[int]) -> None:
    """Let the controller run anywhere but there: an arm's own is another machine, and takes no time from this one."""
    for task in Path(f"/proc/{process.pid}/task").iterdir():
        os.sched_setaffinity(int(task.name), os.sched_getaffinity(0) - cpus)


def _note(process: ControllerProcess, *, at_s: float, n_missed_before: float) -> _Block:
    ticks = _ticks(process, clear=False)
    assert process.pid is not None, "it runs"
    return _Block(
        at_s=at_s,
        client_mb=_resident_mb(os.getpid()),
        controller_mb=_resident_mb(process.pid),
        tick_p50_ms=ticks["p50"] * 1e-3,
        tick_p99_ms=ticks["p99"] * 1e-3,
        n_missed=ticks["n_missed"] - n_missed_before,
    )


def _ticks(process: ControllerProcess, *, clear: bool) -> dict[str, float]:
    return msgspec.convert(process.fault("ticks", clear=clear), dict[str, float])


def _resident_mb(pid: int) -> float:
    pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / MB


def _own_host() -> str:
    """Return a loopback address that only a process of this number takes."""
    pid = os.getpid()
    return f"127.{8 + (pid >> 15) % 16}.{pid >> 7 & 0xFF}.{1 + (pid & 0x7F)}"
