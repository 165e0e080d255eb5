"""The check of a rig whose arm is on a wire: streams end at the gate of a shadow, the arm is only looked at.

The shadow is the twin in lock-step, motion and gate before it, that begins at the joints of the arm that was found; the
battery, its plants and the monitor are a twin's own. Meanwhile that arm must stand, by its own measurement.
"""

from contextlib import ExitStack, closing
from time import perf_counter

import msgspec

from config.resolved import Resolved
from robot.bench import BenchResult
from robot.bus import Bus, Role
from robot.bus.twin_link import RemoteTruth
from robot.errors import RobotConfigError, SafetyError
from robot.hal.sight import Observer, Watched
from robot.messages import Hold, ObjectPose
from robot.rigs import build_plant, check_usable
from robot.teleop import Send
from robot.teleop.wanted import Answer, Wanted
from robot.watching import STILL_RAD, StandStill, Watcher
from sim_twin.as_seen import Beginning
from sim_twin.checking.check import Setup, setup_of
from sim_twin.checking.command import keep, measured
from sim_twin.checking.report import CheckReport, as_json
from sim_twin.checking.ring import Ring
from sim_twin.checking.shadow_report import ShadowReport, WatchedArm, shown_shadow
from sim_twin.perturb import NOMINAL, PERTURBATIONS
from sim_twin.shadow import mirrored

__all__ = ["check_in_shadow"]

LOOK_S = 0.02
N_LENGTHENED = 3
"""A plant whose links and tool are longer by e each is off by at most three times that."""
OFF_M = N_LENGTHENED * max(by.kinematics_m for by in PERTURBATIONS)
N_STANDING = 10


def check_in_shadow(resolved: Resolved, wanted: Wanted) -> Answer:
    """Check a rig whose arm is on a wire; nothing is sent to that arm.

    Raises:
        RobotConfigError: the rig is not filled in, another arm is found, or limits were to be weakened.
        SafetyError: the arm moved, a program began on it, or it stands outside of the limits.
        WireError: nobody answers, or its link was lost.
    """
    if wanted.mutate:
        raise RobotConfigError("--mutate: expected a twin's rig: a limit that is weakened is weakened before no arm")
    check_usable(resolved.rig)
    plant = build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario, cell=resolved.cell)
    if not isinstance(plant, Watched):
        raise RobotConfigError(f"rig {resolved.rig.name}: expected a plant whose arm can be looked at, it cannot be")
    with ExitStack() as stack:
        observer = stack.enter_context(closing(plant.observer()))
        _require_expected(resolved, observer)
        observer.connect()
        things = perceived(resolved)
        begin, still = perf_counter(), StandStill()
        watcher = stack.enter_context(Watcher(observer, take=still, period_s=LOOK_S))
        setup = setup_of(mirrored(resolved), wanted, start=_start(resolved, still, things))
        _require_inside(setup)
        report = measured(setup, wanted, look=watcher.require)
        watcher.require()
        told = _told(resolved, report, observer, still, is_perceived=bool(things), seconds=perf_counter() - begin)
        if wanted.out is not None:
            keep(setup, told, wanted.out, about=told.about)
    return Answer(json=as_json(told), shown=shown_shadow(told), is_passed=told.is_passed)


def perceived(resolved: Resolved) -> tuple[ObjectPose, ...]:
    """Return where the rig perceives the things of its table; nothing where it perceives none.

    Raises:
        WireError: nobody tells of them.
    """
    rig = resolved.rig
    if rig.perception is None or rig.bus is None:
        return ()
    with Bus(rig.bus, serial=rig.expected.serial, role=Role.VIEWER, keys=rig.keys) as bus:
        truth = RemoteTruth(bus)
        truth.wait_next()
        return truth.read().objects


def _require_expected(resolved: Resolved, observer: Observer) -> None:
    """Refuse another kind of plant than the rig names; who it is is asked at connecting."""
    rig, found = resolved.rig, observer.identity.kind.value
    if found != rig.expected.kind:
        raise RobotConfigError(
            f"rig {rig.name}: expected.kind is {rig.expected.kind}, at {rig.address} there can only be a {found} arm"
        )


def _start(resolved: Resolved, still: StandStill, things: tuple[ObjectPose, ...]) -> Beginning:
    """Return where shadows begin: the arm as it is, its hand taken to be open and empty, for nobody speaks to it."""
    sight = still.first
    assert sight is not None, "the watcher has looked"
    return Beginning(
        q_rad=sight.q_rad, tcp_m=sight.tcp_m, digital_out=sight.digital_out, opening_m=resolved.arm.tool.stroke_m,
        things=things,
    )  # fmt: skip


def _require_inside(setup: Setup) -> None:
    """Refuse an arm that breaks a limit by standing where it does: no stream would say more.

    Raises:
        SafetyError: which limit, and by how much.
    """
    ring = Ring(setup.resolved, NOMINAL, setup.profile, n_commands=N_STANDING, start=setup.start)
    try:
        came = ring.run(
            lambda *_: iter([Send(Hold())] * N_STANDING), number=0, family="standing", seed=setup.seed
        )  # fmt: skip
    finally:
        ring.close()
    if came.broken or came.n_latches:
        off = ", ".join(f"{r.limit} by {-r.share:.1%}" for r in came.broken) or "the gate refuses to hold it there"
        raise SafetyError(
            f"expected an arm that stands inside of the limits of profile {setup.profile.name}, it does not: {off}. "
            "Lead it over the table, the tool at travel height and pointing down"
        )


def _told(
    resolved: Resolved,
    report: CheckReport,
    observer: Observer,
    still: StandStill,
    *,
    is_perceived: bool,
    seconds: float,
) -> ShadowReport:
    """Return the report of the streams with what was seen of the arm meanwhile."""
    first, identity = still.first, observer.identity
    assert first is not None, "the watcher has looked"
    arm = WatchedArm(
        kind=identity.kind.value, model=identity.model, serial=identity.serial, address=resolved.rig.address or "",
        q_rad=first.q_rad, mode=first.mode.value, n_looks=still.n_looks, watched_s=round(seconds, 1),
        moved_rad=still.farthest_rad, tool_off_m=observer.tool_off_m, is_table_perceived=is_perceived,
    )  # fmt: skip
    rows = (
        BenchResult(
            name="arm_moved_rad", value=arm.moved_rad, unit="rad", goal=f"<= {STILL_RAD:g}",
            ok=arm.moved_rad <= STILL_RAD,
        ),
        BenchResult(
            name="tool_off_mm", value=1e3 * arm.tool_off_m, unit="mm", goal=f"<= {1e3 * OFF_M:g}",
            ok=arm.tool_off_m <= OFF_M,
        ),
    )  # fmt: skip
    fields = {**msgspec.structs.asdict(report), "results": (*report.results, *rows), "rig": resolved.rig.name}
    return ShadowReport(**fields, arm=arm, is_shadow=True)
