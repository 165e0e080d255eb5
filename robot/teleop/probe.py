"""`teleop check --probe`: an arm on a wire is armed in its rig's own way and moved a little, a person attending."""

import sys
from collections import deque
from contextlib import closing
from time import perf_counter, sleep

import msgspec
from rich.console import RenderableType
from rich.markup import escape
from rich.table import Table

from config.limited import limited
from config.posture import tilt_rad
from config.resolved import Resolved
from robot.bench import BenchReport, BenchResult, bench_report
from robot.chain import ToolChain
from robot.errors import ArmRefusedError, RobotConfigError
from robot.hal.sight import Observer, Sight, Watched
from robot.local_station import LocalStation
from robot.messages import PlantIdentity
from robot.rigs import build_plant, build_station, check_usable
from robot.safety import Operator
from robot.teleop.attending import Attendant, attending
from robot.teleop.probe_judge import Carried, judge_probe
from robot.teleop.probe_run import ProbeRun
from robot.teleop.probes import ASKED_M_S, PROFILE, Probe, plan, probe_rig_of
from robot.teleop.wanted import Answer, Wanted
from robot.watching import Watcher

__all__ = ["ProbeReport", "probe_rig"]

LOOK_S = 0.004
N_SIGHTS = 30_000
"""Two minutes of looks; what is older is of no probe that goes on."""
LEASE_NS = 2_000_000_000
"""A list that did not come round for so long is gone: the arm is disarmed."""
STILL_RAD_S = 0.01
LET_GO_S = 2.0


class ProbeReport(BenchReport, frozen=True, kw_only=True):
    """What came of a probe list, and of which arm."""

    rig: str
    profile: str
    """The rig's own; the list's is narrower."""
    plant: PlantIdentity
    address: str
    armed_by: str
    n_probes: int
    n_done: int
    ended: str = ""
    """Why before its end, where it was."""

    @property
    def is_passed(self) -> bool:
        """Whether every probe was carried out, and every figure is what it is asked to be."""
        return self.n_done == self.n_probes and all(result.ok for result in self.results)


def probe_rig(resolved: Resolved, wanted: Wanted) -> Answer:
    """Move a rig's arm by the list and judge it by its own measurement.

    Raises:
        RobotConfigError: the rig is not filled in, or another arm is found.
        SafetyError: nobody attends, the arm is not armed, its tool is tilted, or has too little room.
        WireError: nobody answers, or its link was lost.
    """
    check_usable(resolved.rig)
    operator, attendant = attending(resolved.rig, is_terminal=sys.stdin.isatty())
    plant = build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario, cell=resolved.cell)
    if not isinstance(plant, Watched):
        raise RobotConfigError(f"rig {resolved.rig.name}: expected a plant whose arm can be looked at, it cannot be")
    begin = perf_counter()
    with closing(plant.observer()) as observer:
        observer.connect()
        probes, narrowed = _planned(resolved, observer)
        attendant.tell(_announced(resolved, observer, probes))
        with build_station(narrowed, is_driven=True) as station:
            carried, ended = _carried_out(station, observer, operator, attendant, probes)
        rows = [row for each in carried for row in judge_probe(each, narrowed.profile.stopping)]
        rows += _let_go(observer)
        report = ProbeReport(
            **msgspec.structs.asdict(bench_report("probe", rows, seconds=perf_counter() - begin)),
            rig=resolved.rig.name, profile=resolved.rig.profile, plant=observer.identity,
            address=resolved.rig.address or "", armed_by=getattr(operator, "name", type(operator).__name__),
            n_probes=len(probes), n_done=sum(each.is_done for each in carried), ended=ended,
        )  # fmt: skip
    text = msgspec.json.encode(report).decode()
    if wanted.out is not None:
        wanted.out.mkdir(parents=True, exist_ok=True)
        (wanted.out / "probe.json").write_text(text + "\n", encoding="utf-8")
    return Answer(json=text, shown=_shown(report), is_passed=report.is_passed)


def _planned(resolved: Resolved, observer: Observer) -> tuple[tuple[Probe, ...], Resolved]:
    """Return the list for where the arm stands, and the rig narrowed by it.

    Raises:
        ArmRefusedError: somebody's program runs on the arm.
        SafetyError: the tool is tilted, or there is too little room.
    """
    sight = observer.see()
    if sight.is_program_running:
        raise ArmRefusedError("expected no program on the arm, one is running: whoever started it must stop it")
    held = limited(resolved.arm, resolved.profile)
    tool_m, tilt = ToolChain(held).tcp(sight.q_rad), tilt_rad(held, sight.q_rad)
    probes, box = plan(tool_m, held.motion.workspace_m, tilt_rad=tilt)
    return probes, probe_rig_of(resolved, box)


def _announced(resolved: Resolved, observer: Observer, probes: tuple[Probe, ...]) -> str:
    identity = observer.identity
    lines = (f"  {k}. {probe.told}" for k, probe in enumerate(probes, start=1))
    return "\n".join((
        f"probe list on the {identity.kind.value} arm {identity.serial} at {resolved.rig.address}, profile "
        f"{resolved.rig.profile} and narrower ({PROFILE}), at {1e3 * ASKED_M_S:g} mm/s:", *lines,
        "before the first the arm is taken: a hand that is not active then strokes fully open and shut",
        "stand clear, hand on the emergency stop; Ctrl-C stops the arm too",
    ))  # fmt: skip


def _carried_out(
    station: LocalStation,
    observer: Observer,
    operator: Operator,
    attendant: Attendant,
    probes: tuple[Probe, ...],
) -> tuple[list[Carried], str]:
    """Have the station armed and carry the list out; return what came of each probe, and why there are no more."""
    sights: deque[Sight] = deque(maxlen=N_SIGHTS)
    station.take_lease("teleop check --probe", life_ns=LEASE_NS)
    operator.arm_once(station)
    carried: list[Carried] = []
    with Watcher(observer, take=sights.append, period_s=LOOK_S) as watcher:
        run = ProbeRun(station=station, sights=sights)
        for probe in probes:
            if not _is_wanted(run, attendant, f"{len(carried) + 1} of {len(probes)}, {probe.told}"):
                return carried, run.refusal or "ended by the person who attends"
            carried.append(run.run(probe))
            watcher.require()
            if run.refusal and len(carried) < len(probes):
                return carried, run.refusal
    return carried, ""


def _is_wanted(run: ProbeRun, attendant: Attendant, text: str) -> bool:
    """Ask, and hold the arm until there is an answer. False also where command was lost meanwhile."""
    attendant.ask(text)
    while not run.refusal:
        said = attendant.heard()
        if said in ("", "y", "yes"):
            return True
        if said in ("n", "no", "q"):
            return False
        if said is not None:
            attendant.ask(text)
        run.hold()
    return False


def _let_go(observer: Observer) -> list[BenchResult]:
    """Look whether the arm rests and was let go of: what is disarmed has no program, its watchdog sees to it."""
    sight, end_s = observer.see(), perf_counter() + LET_GO_S
    while sight.is_program_running and perf_counter() < end_s:
        sleep(LOOK_S)
        sight = observer.see()
    fastest, is_running = max(map(abs, sight.qd_rad_s)), sight.is_program_running
    return [
        BenchResult(name="end_program_runs", value=float(is_running), unit="1", goal="0", ok=not is_running),
        BenchResult(
            name="end_speed_rad_s", value=fastest, unit="rad/s", goal=f"<= {STILL_RAD_S:g}", ok=fastest <= STILL_RAD_S
        ),
    ]


def _shown(report: ProbeReport) -> tuple[RenderableType, ...]:
    """Return one row a figure, and what arm it was."""
    plant = report.plant
    table = Table(title=f"probe list: rig {report.rig}, profile {report.profile}, {report.n_done} of {report.n_probes}")
    for name in ("figure", "came", "unit", "asked", "ok"):
        table.add_column(name, justify="right" if name in ("came", "asked") else "left", no_wrap=True)
    for row in report.results:
        came, verdict = f"{row.value:.3g}", "yes" if row.ok else "NO"
        table.add_row(row.name, came, row.unit, row.goal, verdict, style=None if row.ok else "red")
    told = [
        f"MOVED the {plant.kind.value} arm {plant.model} {plant.serial} at {report.address}, armed by "
        f"{report.armed_by}, judged by the arm's own measurement, in {report.seconds:.0f} s; then it was let go of."
    ]
    told += [f"{row.name}: {key} {text}" for row in report.results for key, text in (row.details or {}).items()]
    told += [f"The list ended early: {report.ended}."] if report.ended else []
    return table, *(escape(line) for line in told)
