"""The motion bench: what one tick of motion and gate costs on the working table, beside placo's solve alone."""

import math
import tempfile
from collections.abc import Callable
from pathlib import Path
from time import perf_counter, perf_counter_ns

import numpy as np
import placo

from config.limited import limited
from config.loader import resolve
from config.resolved import Resolved
from robot.bench import BenchReport, BenchResult, bench_report
from robot.description import write_mjcf
from robot.messages import ArmCommand, GripCommand, Heading, Hold, Intent, JointTarget, Twist, Vec6
from robot.safety import Clearance, Hard, Obstacles
from robot.surroundings import Place, Surroundings
from robot.tick_loop import guarded
from sim_twin.plant import TwinPlant

__all__ = ["Costs", "bench_motion", "measure"]

TICK_GOAL_US = 100.0
DECISIONS_A_TABLE = 60
WARM_UP = 120
STEP_S = 0.05


class Costs:
    """Microseconds of every call, none left out."""

    def __init__(self) -> None:
        self.tick_us: list[float] = []
        self.gate_us: list[float] = []
        self.intent_us: list[float] = []
        self.distance_us: list[float] = []
        self.bare_us: list[float] = []
        self.n_latches = 0


def _intent(rng: np.random.Generator, home_rad: tuple[float, ...], kind: float) -> Intent:
    """Draw an intent: mostly headings at both heights, as a learner's, then twists, joint targets and rest."""
    if kind < 0.6:
        low = bool(rng.random() < 0.4)
        return Heading(
            heading_rad=float(rng.uniform(-math.pi, math.pi)), distance_m=0.022, height_m=0.025 if low else 0.225
        )
    if kind < 0.9:
        x, y, z = (0.4 * rng.normal(size=3)).tolist()
        return Twist(linear_m_s=(x, y, z), angular_rad_s=(0.0, 0.0, float(rng.normal())))
    if kind < 0.97:
        a, b, c, d, e, f = (np.asarray(home_rad) + 0.2 * rng.normal(size=6)).tolist()
        return JointTarget(q_rad=(a, b, c, d, e, f))
    return Hold()


class _Drive:
    """Motion and gate on the twin, led by drawn intents, every call timed."""

    def __init__(self, resolved: Resolved, seed: int) -> None:
        self._resolved, self._rng = resolved, np.random.default_rng(seed)
        self._plant = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig)
        self._arm, tool = self._plant.arm, resolved.arm.tool
        self._arm.connect()
        self._mover, self._gate = guarded(
            arm=self._arm,
            config=limited(resolved.arm, resolved.profile),
            scenario=resolved.scenario,
            rig=resolved.rig,
            profile=resolved.profile,
            when_latched=None,
        )
        self._obstacles = Obstacles(resolved.scenario)
        self._clearance = Clearance(resolved.arm, resolved.scenario, hard=Hard())
        self._bare = _bare_solve(resolved)
        self._grip = GripCommand(opening_m=tool.stroke_m, force_n=tool.grip_force_n, speed_m_s=tool.speed_m_s[1])
        self._n_ticks = round(STEP_S / resolved.rig.tick_s)
        self._intent: Intent = Hold()
        self._n_left = 0

    def reset(self) -> None:
        """Lay out another table and start anew."""
        self._plant.resetter.reset(seed=int(self._rng.integers(1 << 30)), epoch=0, digital_out=0)
        self._state = self._arm.read()
        self._gate.seed(self._state)
        self._mover.seed(self._state)
        self._obstacles.seed(self._state.digital_out, self._state.stamp_ns)
        self._obstacles.perceive(_perceived(self._plant))
        self._mover.surround(self._obstacles.blocks)
        self._gate.surround(self._obstacles.blocks)
        self._n_left = 0

    def decide(self, costs: Costs) -> None:
        """Keep the intent or draw another one, and carry it out for a time step."""
        if self._n_left == 0:
            self._intent = _intent(self._rng, self._resolved.arm.home_rad, self._rng.random())
            self._n_left = int(self._rng.integers(1, 11))
        self._n_left -= 1
        self._gate.admit(self._intent, now_ns=self._arm.clock.now_ns())
        begin = perf_counter_ns()
        self._mover.begin_step(self._intent, self._state, duration_s=STEP_S)
        costs.intent_us.append((perf_counter_ns() - begin) / 1e3)
        for _ in range(self._n_ticks):
            if not self._tick(costs):
                costs.n_latches += 1
                self.reset()
                return

    def _tick(self, costs: Costs) -> bool:
        arm, gate = self._arm, self._gate
        now_ns = arm.clock.now_ns()
        begin = perf_counter_ns()
        q_rad = self._mover.tick(self._state)
        command = ArmCommand(
            stamp_ns=now_ns, sequence=gate.next_sequence, q_rad=q_rad, grip=self._grip, digital_out=0
        )  # fmt: skip
        middle = perf_counter_ns()
        verdict = gate.write(command, self._state, now_ns=now_ns)
        end = perf_counter_ns()
        costs.tick_us.append((end - begin) / 1e3)
        costs.gate_us.append((end - middle) / 1e3)
        if verdict is not None:
            return False
        self._time_beside(q_rad, costs)
        arm.clock.wait_tick()
        self._state = arm.read()
        return True

    def _time_beside(self, q_rad: Vec6, costs: Costs) -> None:
        begin = perf_counter_ns()
        self._clearance.gap(q_rad)
        middle = perf_counter_ns()
        self._bare()
        costs.distance_us.append((middle - begin) / 1e3)
        costs.bare_us.append((perf_counter_ns() - middle) / 1e3)


def _perceived(plant: TwinPlant) -> Surroundings:
    """Return what a perception that sees everything would hand down with a time step."""
    assert plant.truth is not None, "a twin has one"
    scene = plant.truth.read()
    places = tuple(Place(position_m=thing.position_m, quat=thing.quat) for thing in scene.objects)
    return Surroundings(stamp_ns=scene.stamp_ns, places=places)


def measure(resolved: Resolved, *, n_decisions: int, seed: int) -> Costs:
    """Drive the twin by drawn intents, each kept for up to 10 time steps, and time every tick of motion and gate."""
    drive, costs = _Drive(resolved, seed), Costs()
    for k in range(-WARM_UP, n_decisions):
        if k == 0:
            costs = Costs()
        if k % DECISIONS_A_TABLE == 0:
            drive.reset()
        drive.decide(costs)
    return costs


def bench_motion(*, full: bool) -> BenchReport:
    """Time motion and gate, all checks on, tick by tick, with placo's bare solve beside them in the same run."""
    begin = perf_counter()
    costs = measure(resolve(), n_decisions=20_000 if full else 3_000, seed=0)
    tick_us = _share(costs.tick_us, 99)
    results = (
        _row("tick_p50_us", _share(costs.tick_us, 50)),
        BenchResult(
            name="tick_p99_us", value=tick_us, unit="us", goal=f"<= {TICK_GOAL_US:g}", ok=tick_us <= TICK_GOAL_US
        ),
        _row("bare_ik_p50_us", _share(costs.bare_us, 50)),
        _row("bare_ik_p99_us", _share(costs.bare_us, 99)),
        _row("gate_p50_us", _share(costs.gate_us, 50)),
        _row("gate_p99_us", _share(costs.gate_us, 99)),
        _row("distances_p50_us", _share(costs.distance_us, 50)),
        _row("distances_p99_us", _share(costs.distance_us, 99)),
        _row("intent_p50_us", _share(costs.intent_us, 50)),
        _row("intent_p99_us", _share(costs.intent_us, 99)),
        BenchResult(name="ticks", value=float(len(costs.tick_us)), unit="1"),
        BenchResult(name="latches", value=float(costs.n_latches), unit="1"),
    )
    return bench_report("motion", results, seconds=perf_counter() - begin)


def _bare_solve(resolved: Resolved) -> Callable[[], None]:
    """Return placo's solve and update for a target of the tool, as its documentation has it, nothing around it."""
    with tempfile.TemporaryDirectory(prefix="autotelic_") as folder:
        path = Path(folder) / "arm.xml"
        write_mjcf(resolved.arm, path)
        robot = placo.RobotWrapper(str(path), placo.Flags.mjcf | placo.Flags.ignore_collisions)
    solver = placo.KinematicsSolver(robot)
    offset = robot.get_joint_offset(resolved.arm.joints[0].name)
    if offset:
        q = robot.state.q
        q[:] = 0.0
        q[offset - 1] = 1.0
        robot.state.q = q
        solver.mask_fbase(True)
    robot.update_kinematics()
    task = solver.add_frame_task("tcp", robot.get_T_world_frame("tcp"))
    task.configure("tcp", "soft", 1.0, 1.0)

    def solve() -> None:
        solver.solve(True)
        robot.update_kinematics()

    return solve


def _share(values: list[float], percent: float) -> float:
    return float(np.percentile(values, percent))


def _row(name: str, value: float) -> BenchResult:
    return BenchResult(name=name, value=value, unit="us")
