"""Benches of the twin: how fast it is, and whether its grasp holds."""

import math
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
from sim_twin.names import on_table
from sim_twin.pilot import Pilot
from sim_twin.plant import TwinPlant, TwinWorld

__all__ = ["bench_grasp", "bench_twin", "open_twin"]

STACK_GOAL_US = 300.0
SCALING_GOAL = 1.9
HOLD_GOAL = 0.98
SLIP_GOAL_MM = 1.0
FIRST_SEED = 200
"""Tables of seeds below this were looked at while contacts were chosen: none of them is reported."""


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


class _Pick(msgspec.Struct, frozen=True):
    """One pick: was it ever held, was it held to the end, how far did it slip, and was a drop seen."""

    was_held: bool
    is_held: bool
    slip_m: float
    is_reported_held: bool


def bench_grasp(*, full: bool) -> BenchReport:
    """Pick from inside the boxes, carry at top speed, stop hard; then the same with a fifth of the friction."""
    begin = perf_counter()
    resolved = resolve()
    n = 200 if full else 60
    firm = _pick_all(resolved, n)
    slippery = _pick_all(_with_friction(resolved, 0.2), n // 2)
    held = [p for p in firm if p.is_held]
    hold_rate = len(held) / len(firm)
    slip_mm = 1e3 * float(np.percentile([p.slip_m for p in held], 95)) if held else math.inf
    dropped = [p for p in (*firm, *slippery) if p.was_held and not p.is_held]
    seen = sum(not p.is_reported_held for p in dropped) / len(dropped) if dropped else 1.0
    drop_rate = sum(p.was_held and not p.is_held for p in slippery) / len(slippery)
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
    )
    return bench_report("grasp", results, seconds=perf_counter() - begin)


def _with_friction(resolved: Resolved, share: float) -> Resolved:
    """Return the same table with slippery cylinders."""
    scenario = resolved.scenario
    cylinders = tuple(msgspec.structs.replace(c, friction=c.friction * share) for c in scenario.cylinders)
    return msgspec.structs.replace(resolved, scenario=msgspec.structs.replace(scenario, cylinders=cylinders))


def _pick_all(resolved: Resolved, n: int) -> list[_Pick]:
    """Pick every boxed cylinder in turn, each at a newly drawn place and turn, with its lid open."""
    last_epoch = resolved.scenario.schedule[-1].from_epoch
    station, plant = open_twin(resolved)
    pilot = Pilot(station)
    names = [c.name for c in resolved.scenario.cylinders if c.inside is not None]
    picks = []
    for k in range(n):
        pilot.reset(seed=FIRST_SEED + k, epoch=last_epoch)
        picks.append(_pick(pilot, plant, names[k % len(names)], side=1 if k % 4 < 2 else -1))
    return picks


def _pick(pilot: Pilot, plant: TwinPlant, name: str, *, side: int) -> _Pick:
    """Pick one, lift it, carry it across the table at top speed and stop while moving."""
    x, y, _ = pilot.where(name)
    pilot.go(x, y)
    pilot.rest()
    was_held = pilot.down(lambda r: r.percept.grip.has_object)
    pilot.rest(4)
    start = _in_hand(plant, name)
    for _ in range(14):
        pilot.step()
    heading = math.atan2(-y, 0.42 - x) if side > 0 else math.atan2(-y, 0.36 - x)
    for _ in range(12):
        pilot.step(heading_rad=heading, distance_m=0.022)
    plant.arm.stop()
    for _ in range(60):
        plant.arm.clock.wait_tick()
    end = _in_hand(plant, name)
    is_held = bool(np.linalg.norm(end) < HELD_WITHIN_M)
    return _Pick(was_held, is_held, float(np.linalg.norm(end - start)), plant.arm.read().grip.has_object)


HELD_WITHIN_M = 0.03


def _in_hand(plant: TwinPlant, name: str) -> np.ndarray:
    """Return an object's position in the tool's frame, from the physics.  (3,)"""
    data = plant.world.data
    mujoco.mj_kinematics(plant.world.model, data)
    tcp = data.site("tcp")
    return tcp.xmat.reshape(3, 3).T @ (data.body(on_table(name)).xpos - tcp.xpos)
