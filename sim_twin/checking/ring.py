"""One plant, the stack that holds it, and the monitor beside it: lets a stream loose and says what came of it."""

from collections.abc import Callable, Iterator

import msgspec

from config.limits import Profile
from config.perturbation import Perturbation
from config.resolved import Resolved
from robot.errors import NotEngagedError
from robot.messages import ArmCommand, GripCommand, Hold, StationMode, Vec6
from robot.rigs import build_operator, build_station
from robot.safety import Operator
from robot.teleop import Arena, Ask, Look, Seen, Send, Silence, Write
from robot.tick_loop import TickLoop
from sim_twin.allowances import allowances_for
from sim_twin.as_seen import AsSeen, Beginning
from sim_twin.monitor import Monitor
from sim_twin.perturb import perturbed_plant
from sim_twin.readings import Margin, Reading
from sim_twin.recorder import Course, Recorder

__all__ = ["Ring", "StreamResult", "arena_of"]

LATCHED_ASKS = 40
"""So many asks more meet a latched station before an operator arms it again."""
REST_RAD_S, REST_M_S = 1e-3, 1e-3
MOST_TICKS_PER_COMMAND = 6
RESTFUL_TICKS = 40
"""A silence as long as this must have ended in rest."""


class StreamResult(msgspec.Struct, frozen=True, kw_only=True):
    """What came of one stream."""

    number: int
    family: str
    plant: str
    n_commands: int
    n_latches: int
    readings: tuple[Reading, ...]
    rest_ms: float | None = None
    """Longest from the beginning of a silence to rest, where one was long enough to tell."""

    @property
    def broken(self) -> tuple[Reading, ...]:
        """The limits that were broken."""
        return tuple(r for r in self.readings if r.is_broken)


def arena_of(resolved: Resolved, profile: Profile) -> Arena:
    """Return what streams aim at, from the files."""
    arm, scenario, boxes = resolved.arm, resolved.scenario, profile.workspace.boxes
    table_m, (low, high) = scenario.table.height_m, arm.motion.workspace_m
    for box in boxes:
        low = (max(low[0], box.low_m[0]), max(low[1], box.low_m[1]), max(low[2], box.low_m[2]))
        high = (min(high[0], box.high_m[0]), min(high[1], box.high_m[1]), min(high[2], box.high_m[2]))
    grip = profile.grip
    tops = [(*b.position_m, table_m + b.height_m) for b in (*scenario.buttons, *scenario.boxes)]
    loose = [(*c.position_m, table_m + c.height_m / 2) for c in scenario.cylinders]
    planes = [_beyond(p.point_m, p.normal) for p in profile.workspace.planes]
    keeps = [_between(k.low_m, k.high_m) for k in profile.workspace.keep_outs]
    force, speed = grip.force_n[1], grip.speed_m_s[1]
    return Arena(
        tick_s=resolved.rig.tick_s,
        speed_m_s=profile.speeds.tcp_m_s,
        box_m=(low, high),
        q_min_rad=_vec6([j.range_rad[0] for j in profile.joints]),
        q_max_rad=_vec6([j.range_rad[1] for j in profile.joints]),
        qd_max_rad_s=_vec6([j.speed_rad_s for j in profile.joints]),
        home_rad=arm.home_rad,
        things_m=(*tops, *loose, ((low[0] + high[0]) / 2, 0.0, table_m)),
        loose_m=tuple(loose),
        fences_m=(*planes, *keeps),
        grip=(
            GripCommand(opening_m=grip.opening_m[1], force_n=force, speed_m_s=speed),
            GripCommand(opening_m=grip.opening_m[0], force_n=force, speed_m_s=speed),
        ),
        grip_least=GripCommand(opening_m=grip.opening_m[0], force_n=grip.force_n[0], speed_m_s=grip.speed_m_s[0]),
    )


class Ring:
    """A perturbed plant under the whole stack, with a recorder in its physics.

    Args:
        resolved: rig, arm, scenario and the limits that the stack holds.
        perturbation: how the plant differs from its file.
        profile: the limits that the monitor holds: the stack's own, or the true ones where those were weakened.
        n_commands: how many commands a stream has.
        start: where arm and table are at the beginning; drawn for each stream where None.
    """

    def __init__(
        self,
        resolved: Resolved,
        perturbation: Perturbation,
        profile: Profile,
        *,
        n_commands: int,
        start: Beginning | None = None,
    ) -> None:
        rig = msgspec.structs.replace(resolved.rig, max_latches=10_000)  # latching is what it is here for
        self._resolved = msgspec.structs.replace(resolved, rig=rig)
        self._plant_name, self._n_commands = perturbation.name, n_commands
        self._plant = perturbed_plant(self._resolved, perturbation)
        if start is not None:
            self._plant.resetter = AsSeen(self._plant.world, start)
        self._station = build_station(self._resolved, plant=self._plant)
        operator = build_operator(rig)
        assert operator is not None, "a twin's rig names an operator"
        self._operator: Operator = operator
        loop = self._station.loop
        assert isinstance(loop, TickLoop), "a twin's loop runs in this process"
        self._loop = loop
        world = self._plant.world
        self._most_ticks = MOST_TICKS_PER_COMMAND * n_commands + 200
        self._recorder = Recorder(world, most_ticks=self._most_ticks + 200)
        self._monitor = Monitor(world, profile, allowances_for(profile, perturbation))
        self.arena = arena_of(resolved, profile)
        self._n_latches = 0
        self._since_latch: int | None = None
        self._silences: list[tuple[int, int]] = []
        self.course: Course | None = None
        """What was recorded of the newest stream."""

    def close(self) -> None:
        """Stop and release."""
        self._station.close()

    def look(self) -> Seen:
        """Return what a driver sees."""
        state = self._loop.state
        return Seen(
            q_rad=state.q_rad,
            tcp_m=state.tcp_position_m,
            force_n=state.tcp_force_n,
            is_latched=self._since_latch is not None,
        )

    def run(self, make: Callable[[Look, Arena], Iterator[Ask]], *, number: int, family: str, seed: int) -> StreamResult:
        """Lay a table out, let a stream loose on it, and judge what the physics did."""
        self._reset(seed)
        self._recorder.clear()
        self._silences, self._n_latches = [], 0
        n = 0
        for ask in make(self.look, self.arena):
            self._meet(ask, seed=seed)
            n += ask.n_ticks if isinstance(ask, Silence) else 1
            if n >= self._n_commands or self._recorder.n_ticks >= self._most_ticks - 100:
                break
        self.course = self._recorder.course()
        return StreamResult(
            number=number,
            family=family,
            plant=self._plant_name,
            n_commands=n,
            n_latches=self._n_latches,
            readings=self._monitor.judge(self.course),
            rest_ms=_rest_ms(self.course, self._silences),
        )

    def margins(self) -> Iterator[Margin]:
        """Return the margins over the newest stream's course, limit by limit."""
        return iter(()) if self.course is None else self._monitor.margins(self.course)

    def _reset(self, seed: int) -> None:
        station, operator = self._station, self._operator
        if station.state.mode is StationMode.DISARMED:
            operator.arm_once(station)
        if station.state.mode is StationMode.LATCHED:
            operator.rearm(station, seed=seed, epoch=0)
        station.reset(seed=seed, epoch=0)
        self._since_latch = None

    def _meet(self, ask: Ask, *, seed: int) -> None:
        """Let one ask meet the stack; a latched one is asked on in vain for a while, as physics goes on."""
        if self._since_latch is not None:
            self._ask_in_vain(ask)
            if self._since_latch >= LATCHED_ASKS and self._is_at_rest():
                self._reset(seed)
            return
        if isinstance(ask, Send):
            came = self._station.step(ask.intent, duration_s=ask.n_ticks * self._resolved.rig.tick_s)  # pyright: ignore[reportArgumentType]
            is_refused = self._station.state.mode is StationMode.LATCHED
            del came
        elif isinstance(ask, Write):
            is_refused = self._write(ask)
        else:
            is_refused = self._be_silent(ask)
        if is_refused:
            self._since_latch = 0
            self._n_latches += 1

    def _ask_in_vain(self, ask: Ask) -> None:
        assert self._since_latch is not None
        if isinstance(ask, Send) and self._station.state.mode is StationMode.LATCHED:
            try:
                self._station.step(ask.intent)  # pyright: ignore[reportArgumentType]
            except NotEngagedError:
                pass
            else:
                raise AssertionError("a latched station carried out an intent")
        self._plant.arm.clock.wait_tick()
        self._since_latch += 1

    def _is_at_rest(self) -> bool:
        return float(abs(self._plant.world.data.qvel[:6]).max()) < REST_RAD_S or (self._since_latch or 0) > 150

    def _write(self, ask: Write) -> bool:
        arm, gate = self._plant.arm, self._loop.gate
        state, now_ns = arm.read(), arm.clock.now_ns()
        outputs = state.digital_out if ask.digital_out is None else ask.digital_out
        command = ArmCommand(
            stamp_ns=now_ns + ask.stamp_off_ns,
            sequence=gate.next_sequence + ask.sequence_off,
            q_rad=ask.q_rad,  # pyright: ignore[reportArgumentType]
            grip=ask.grip or self._same_grip(),
            digital_out=outputs,
        )
        # Intent and percept are fresh: what is under trial is the command.
        gate.admit(Hold(), now_ns=now_ns)
        self._loop.perceive(self._station.look_at(state))
        is_refused = gate.write(command, state, now_ns=now_ns) is not None
        arm.clock.wait_tick()
        self._loop.state = arm.read()
        return is_refused

    def _be_silent(self, ask: Silence) -> bool:
        begin = self._recorder.n_ticks
        grip = self._same_grip()
        is_refused = False
        for _ in range(ask.n_ticks):
            if not is_refused:
                is_refused = self._loop.tick(grip) is not None
            if is_refused:
                self._plant.arm.clock.wait_tick()
        self._silences.append((begin, self._recorder.n_ticks))
        return is_refused

    def _same_grip(self) -> GripCommand:
        world = self._plant.world
        return GripCommand(
            opening_m=world.opening_goal_m,
            force_n=self._resolved.arm.tool.grip_force_n,
            speed_m_s=world.grip_speed_m_s,
        )


def _rest_ms(course: Course, silences: list[tuple[int, int]]) -> float | None:
    """Return the longest from the beginning of a silence to rest, in truth; None where none was long enough."""
    longest, n = None, course.n_substeps
    for begin, end in silences:
        if end - begin < RESTFUL_TICKS:
            continue
        speed = course.speed_m_s[begin * n : end * n, 0]
        moving = [i for i in range(len(speed)) if speed[i] > REST_M_S]
        rest = (moving[-1] + 1 if moving else 0) * course.physics_s * 1e3
        longest = rest if longest is None else max(longest, rest)
    return longest


def _beyond(point: tuple[float, float, float], normal: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (p - 0.1 * n for p, n in zip(point, normal, strict=True))
    return x, y, z


def _between(low: tuple[float, ...], high: tuple[float, ...]) -> tuple[float, float, float]:
    x, y, z = ((a + b) / 2 for a, b in zip(low, high, strict=True))
    return x, y, z


def _vec6(x: list[float]) -> Vec6:
    return x[0], x[1], x[2], x[3], x[4], x[5]
