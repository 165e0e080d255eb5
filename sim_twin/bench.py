"""Benches of the twin: how fast it is, and whether its grasp holds."""

import math
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from time import perf_counter, sleep

import msgspec
import mujoco
import numpy as np

from config.loader import resolve
from config.resolved import Resolved
from robot.bench import BenchReport, BenchResult, bench_report
from robot.local_station import LocalStation
from robot.messages import Heading
from robot.operated import OperatedStation
from robot.rigs import build_operator, build_station
from sim_twin.picks import Pick, pick_all, pick_off_centre
from sim_twin.plant import TwinPlant, TwinWorld

__all__ = ["bench_grasp", "bench_twin", "open_twin"]

STACK_GOAL_US = 300.0
SCALING_GOAL = 1.9
HOLD_GOAL = 0.98
SLIP_GOAL_MM = 1.0


def open_twin(resolved: Resolved) -> tuple[LocalStation, TwinPlant]:
    """Return an engaged station on the twin, and its plant."""
    plant = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
    station = build_station(resolved, plant=plant)
    station.connect()
    operator = build_operator(resolved.rig)
    assert operator is not None, "the twin's rig names an operator"
    operator.arm_once(station)
    return station, plant


# ---------------------------------------------------------------------------------------------------------- speed


class _Stopwatch:
    """Physics time inside a run."""

    def __init__(self, world: TwinWorld) -> None:
        self.seconds = 0.0
        world.step_physics = self._step

    def _step(self, model: mujoco.MjModel, data: mujoco.MjData, nstep: int) -> None:
        start = perf_counter()
        mujoco.mj_step(model, data, nstep)
        self.seconds += perf_counter() - start


def _operated(resolved: Resolved, station: LocalStation) -> OperatedStation:
    """Return a station that goes on after a latch, as a learner's does."""
    return OperatedStation(station, build_operator(resolved.rig))


def _wander(station: OperatedStation, n_decisions: int, rng: np.random.Generator) -> None:
    """Random headings and descents, a new table every 60 decisions or after a latch, as an exploring learner's are."""
    low, travel = station.spec.heights_m
    heading = 0.0
    for k in range(n_decisions):
        if k % 60 == 0:
            station.reset(seed=int(rng.integers(1 << 30)), epoch=0)
        if k % 20 == 0:
            heading = rng.uniform(-math.pi, math.pi)
        is_down = k % 60 >= 40
        came = station.step(
            Heading(heading_rad=heading, distance_m=0.0 if is_down else 0.022, height_m=low if is_down else travel)
        )
        if came.is_void:
            station.reset(seed=int(rng.integers(1 << 30)), epoch=0)


def _measure_stack(resolved: Resolved, n_decisions: int) -> tuple[float, float]:
    """Return seconds a decision, whole and physics alone, in one run."""
    made, plant = open_twin(resolved)
    station = _operated(resolved, made)
    rng = np.random.default_rng(0)
    _wander(station, 60, rng)
    watch = _Stopwatch(plant.world)
    start = perf_counter()
    _wander(station, n_decisions, rng)
    whole = perf_counter() - start
    return whole / n_decisions, watch.seconds / n_decisions


def _measure_physics(resolved: Resolved, n_steps: int) -> float:
    """Return bare mj_step steps a second of the scene, lids open, arm holding."""
    plant = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
    lids = sum(1 << b.lid.output for b in resolved.scenario.boxes if b.lid is not None)
    plant.resetter.reset(seed=0, epoch=0, digital_out=lids)
    model, data = plant.world.model, plant.world.data
    mujoco.mj_step(model, data, 500)
    start = perf_counter()
    mujoco.mj_step(model, data, n_steps)
    return n_steps / (perf_counter() - start)


def _work(start_at: float, seconds: float) -> int:
    """Make decisions from a common instant on for a span; return how many. Runs in a process of its own."""
    resolved = resolve()
    station = _operated(resolved, open_twin(resolved)[0])
    rng = np.random.default_rng(0)
    _wander(station, 60, rng)
    sleep(max(0.0, start_at - perf_counter()))
    end = perf_counter() + seconds
    n = 0
    while perf_counter() < end:
        _wander(station, 60, rng)
        n += 60
    return n


def _measure_scaling(seconds: float, rounds: int) -> float:
    """Return decisions of two processes side by side over those of one, the best of interleaved rounds each."""
    warm_up_s = 6.0
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        one, two = [], []
        for k in range(rounds):
            lead = warm_up_s if k == 0 else 1.5
            one.append(pool.submit(_work, perf_counter() + lead, seconds).result())
            at = perf_counter() + lead
            two.append(sum(f.result() for f in [pool.submit(_work, at, seconds) for _ in range(2)]))
    return max(two) / max(one)


def bench_twin(*, full: bool) -> BenchReport:
    """How many physics steps and decisions a second, and what the stack adds."""
    begin = perf_counter()
    resolved = resolve()
    n = 6000 if full else 1500
    physics_rate = max(_measure_physics(resolved, 10 * n) for _ in range(3))
    whole, physics = min((_measure_stack(resolved, n) for _ in range(3)), key=lambda pair: pair[0])
    scaling = _measure_scaling(6.0 if full else 2.0, 3 if full else 2)
    stack_us = (whole - physics) * 1e6
    results = (
        BenchResult(name="physics_steps_per_s", value=physics_rate, unit="1/s"),
        BenchResult(name="decisions_per_s", value=1.0 / whole, unit="1/s"),
        BenchResult(
            name="stack_us_per_decision", value=stack_us, unit="us", goal=f"<= {STACK_GOAL_US:g}",
            ok=stack_us <= STACK_GOAL_US,
        ),
        BenchResult(name="decision_over_physics", value=whole / physics, unit="ratio"),
        BenchResult(
            name="two_process_scaling", value=scaling, unit="ratio", goal=f">= {SCALING_GOAL:g}",
            ok=scaling >= SCALING_GOAL,
        ),
    )  # fmt: skip
    return bench_report("twin", results, seconds=perf_counter() - begin)


# ---------------------------------------------------------------------------------------------------------- grasp


def bench_grasp(*, full: bool) -> BenchReport:
    """Pick from inside the boxes, carry at top speed, stop hard; then with a fifth of the friction, then off centre."""
    begin = perf_counter()
    resolved = resolve()
    n = 200 if full else 60
    firm = _picks(resolved, n, pick_all)
    slippery = _picks(_with_friction(resolved, 0.2), n // 2, pick_all)
    hold_rate = _share([p.is_held for p in firm])
    slip_mm = _slip_mm(firm)
    dropped = [p for p in (*firm, *slippery) if p.was_held and not p.is_held]
    seen = _share([not p.is_reported_held for p in dropped]) if dropped else 1.0
    drop_rate = _share([p.was_held and not p.is_held for p in slippery])
    results = (
        BenchResult(
            name="hold_rate", value=hold_rate, unit="share", goal=f">= {HOLD_GOAL:g}", ok=hold_rate >= HOLD_GOAL
        ),
        BenchResult(
            name="slip_mm_p95", value=slip_mm, unit="mm", goal=f"<= {SLIP_GOAL_MM:g}", ok=slip_mm <= SLIP_GOAL_MM
        ),
        BenchResult(name="drop_seen_rate", value=seen, unit="share", goal="= 1", ok=seen == 1.0),
        BenchResult(name="drop_rate_low_friction", value=drop_rate, unit="share", goal="= 1", ok=drop_rate == 1.0),
        BenchResult(name="picks", value=float(len(firm)), unit="1"),
        *_off_centre_results(_picks(resolved, n, pick_off_centre)),
    )
    return bench_report("grasp", results, seconds=perf_counter() - begin)


def _off_centre_results(picks: Sequence[Pick]) -> list[BenchResult]:
    """Return what became of descents beside an object's centre: was it taken, and what of those that were."""
    taken = [p for p in picks if p.was_held]
    return [
        BenchResult(name="offset_taken_rate", value=_share([p.was_held for p in picks]), unit="share"),
        BenchResult(name="offset_hold_rate", value=_share([p.is_held for p in taken]), unit="share"),
        BenchResult(name="offset_slip_mm_p95", value=_slip_mm(taken), unit="mm"),
        BenchResult(name="offset_picks", value=float(len(picks)), unit="1"),
    ]


def _picks(resolved: Resolved, n: int, way: Callable[[LocalStation, TwinPlant, int], list[Pick]]) -> list[Pick]:
    station, plant = open_twin(resolved)
    return way(station, plant, n)


def _share(of: Sequence[bool]) -> float:
    """Return the share that holds, not a number where there is nothing to count."""
    return sum(of) / len(of) if of else math.nan


def _slip_mm(picks: Sequence[Pick]) -> float:
    """Return the 95th percentile of how far what was held to the end slipped, infinite where nothing was."""
    slips_m = [p.slip_m for p in picks if p.is_held]
    return 1e3 * float(np.percentile(slips_m, 95)) if slips_m else math.inf


def _with_friction(resolved: Resolved, share: float) -> Resolved:
    """Return the same table with slippery cylinders."""
    scenario = resolved.scenario
    cylinders = tuple(msgspec.structs.replace(c, friction=c.friction * share) for c in scenario.cylinders)
    return msgspec.structs.replace(resolved, scenario=msgspec.structs.replace(scenario, cylinders=cylinders))
