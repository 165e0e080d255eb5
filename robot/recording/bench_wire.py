"""What every tick of an arm on a wire, and every frame of its camera, cost who writes and who records them."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from statistics import median
from time import perf_counter_ns, process_time

import numpy as np

from robot.bench import BenchResult
from robot.bus.tick_rows import pack_ticks, unpack_ticks
from robot.frames import frame_of
from robot.messages import ArmCommand, ArmState, GripCommand
from robot.recording.images import ImageCoder
from robot.recording.recorder import Recorder
from robot.recording.sink import Sink
from robot.recording.told_ticks import ToldTicks
from robot.recording.topics import LANES
from robot.tick_ring import TickReader, TickWriter, ring_bytes

__all__ = ["frame_rows", "tick_rows"]

RATE_HZ, BATCH = 500.0, 25
N_FRAMES, SIZE_PX = 40, (640, 480)
NOISE = 2.0
GRIP = GripCommand(opening_m=0.085, force_n=20.0, speed_m_s=0.15)


def tick_rows(folder: Path, states: Sequence[ArmState]) -> list[BenchResult]:
    """Return what ticks cost: in the process that ticks, and in the one that records them.

    Args:
        folder: for a file.
        states: one for each tick.
    """
    memory = bytearray(ring_bytes(RATE_HZ))
    writer, reader = TickWriter(memory), TickReader(memory)
    recorder = Recorder(Sink(folder / "ticks.mcap", may_wait=True), lanes=LANES)
    told = ToldTicks(recorder)
    spans_ns: list[int] = []
    record_s = 0.0
    for n, state in enumerate(states):
        command = ArmCommand(stamp_ns=state.stamp_ns, sequence=n, q_rad=state.q_rad, grip=GRIP, digital_out=0)
        begun_ns = perf_counter_ns()
        writer.measured(state)
        writer.commanded(command, (), None)
        spans_ns.append(perf_counter_ns() - begun_ns)
        if reader.n_waiting == BATCH:
            begun_s = process_time()
            for tick in unpack_ticks(pack_ticks(reader.take(), n_missed=0)):
                told.take(tick)
            record_s += process_time() - begun_s
    begun_s = process_time()
    recorder.close()
    record_s += process_time() - begun_s
    size = (folder / "ticks.mcap").stat().st_size
    each_us = 1e6 * record_s / len(states)
    return [
        BenchResult(name="tick_write_us_p50", value=median(spans_ns) / 1e3, unit="us a tick, where it ticks"),
        BenchResult(name="tick_record_us", value=each_us, unit="us of processor a tick, where it is recorded"),
        BenchResult(name="tick_record_share", value=each_us * RATE_HZ / 1e6, unit="of a processor at 500 Hz"),
        BenchResult(
            name="tick_bytes", value=size / len(states), unit="B a tick in the file",
            details={"an hour": f"{size / len(states) * RATE_HZ * 3600 / 1e6:.0f} MB, all numbers changing"},
        ),
    ]  # fmt: skip


def frame_rows(*, rate_hz: float) -> list[BenchResult]:
    """Return what a camera's frames cost, compressed.

    Args:
        rate_hz: of the camera.
    """
    coder = ImageCoder("jpeg", quality=85)
    make = partial(_picture, np.random.default_rng(0))
    frames = [frame_of(make(), camera="bench", sequence=n, stamp_ns=0, arrival_ns=0) for n in range(N_FRAMES)]
    begun_s = process_time()
    sizes = [len(coder.encode(frame).data) for frame in frames]
    each_ms = 1e3 * (process_time() - begun_s) / N_FRAMES
    return [
        BenchResult(name="frame_encode_ms", value=each_ms, unit="ms of processor a frame of 640 x 480"),
        BenchResult(
            name="frame_bytes_per_hour", value=median(sizes) * rate_hz * 3600, unit=f"B/h at {rate_hz:g} Hz",
            details={"a frame": f"{median(sizes) / 1e3:.0f} kB, painted, with a camera's noise"},
        ),
    ]  # fmt: skip


def _picture(rng: np.random.Generator) -> np.ndarray:
    """Return a painted table with a camera's noise.  -> (480, 640, 3) uint8"""
    width, height = SIZE_PX
    x, y = np.meshgrid(np.linspace(90, 170, width), np.linspace(80, 150, height))
    picture = np.stack([x, y, 0.5 * (x + y)], axis=2)
    for _ in range(12):
        left, upper = rng.integers(0, width - 90), rng.integers(0, height - 90)
        picture[upper : upper + 80, left : left + 80] = rng.integers(0, 255, 3)
    return (picture + rng.normal(0.0, NOISE, picture.shape)).clip(0, 255).astype(np.uint8)
