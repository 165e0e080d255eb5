"""Starts the processes of a rig, watches them, starts again what ended, and ends them all: the arm first and last.

Nothing is armed here. A process that ended or froze has the arm stopped before it is started again; a robot node that
was started again is disarmed.
"""

import shlex
import signal
from collections.abc import Callable
from time import monotonic, sleep

from robot.bus.clock_number import clock_number
from robot.bus.errors import BusError
from robot.bus.session import Bus
from robot.bus.topics import HEALTH
from robot.node.stop_caller import StopCaller
from robot.up.child import Child
from robot.up.clocks import ClockAsker, ClockBook
from robot.up.faults import RandomFaults
from robot.up.logs import Logs
from robot.up.night_watch import NightWatch
from robot.up.plan import Backoff, NodePlan, is_own_end
from robot.up.summary import Event, NodeSummary, Summary, Worst
from robot.up.watch import GONE_S, SILENT_S, HealthBook

__all__ = ["Supervisor"]

LOOK_S = 0.05
START_S = 60.0
STOP_S, NOW_S = 5.0, 1.0
JOB_S, END_S = 30.0, 10.0
USAGE, INTERRUPTED = 2, 130
JOB, SPARE = "job", "other"
"""Kinds of a process: what commands the arm, and what it can do without."""


class _Node:
    """One process, over all its starts."""

    def __init__(self, plan: NodePlan) -> None:
        self.plan, self.backoff = plan, Backoff()
        self.child: Child | None = None
        self.code: int | None = None
        self.n_starts = 0
        self.begun_s = 0.0
        """When it was started last."""
        self.again_s: float | None = None
        """When it is started again."""
        self.is_silent = self.is_over = False
        self.is_faulted = False
        """Its next end was brought about on purpose."""


class Supervisor:
    """Runs a rig's processes.

    Args:
        plans: what to start, in order.
        make_bus: a bus to watch and to say stop on, not yet open.
        logs: where words go.
        rig: its name.
        tell: told of every event.
        night: watches over a run that nobody attends; None where somebody does.
        faults: brought about on purpose, once everything has started; None where there are none.
        now_s: the monotonic clock.
    """

    def __init__(
        self, plans: tuple[NodePlan, ...], *, make_bus: Callable[[], Bus], logs: Logs, rig: str,
        tell: Callable[[Event], object] = lambda _: None, night: NightWatch | None = None,
        faults: RandomFaults | None = None, now_s: Callable[[], float] = monotonic,
    ) -> None:  # fmt: skip
        self.nodes = {plan.name: _Node(plan) for plan in plans}
        self._make_bus, self._logs, self._rig, self._tell, self._now_s = make_bus, logs, rig, tell, now_s
        self._begun_s = now_s()
        self._hub = next((plan.name for plan in plans if plan.kind == "hub"), None)
        self._bus: Bus | None = None
        self._stops: StopCaller | None = None
        self.book = HealthBook(tuple(self.nodes), clock=clock_number(), now_s=now_s)
        self._night, self._faults = night, faults
        self.why_over: str | None = None
        """Why a run that nobody attends ended by itself."""
        self.clocks = ClockBook()
        self._clock_asker: ClockAsker | None = None
        self.events: list[Event] = []
        self._worst = Worst.NOTHING
        self._first_s: float | None = None
        self._last_s: float | None = None
        self._away_s: float | None = None
        """When a process that the job needs ended or fell silent last."""

    def run(self, should_end: Callable[[], bool], *, look: Callable[[], object] = lambda: None) -> Summary:
        """Start everything, and watch it until the job is over, something is given up, or one is told to end.

        Args:
            should_end: asked all the time.
            look: called as often, to show how it is.
        """
        try:
            if self._start_all(should_end, look):
                while not should_end() and not self._is_over() and not self._is_spent():
                    self._bring_about()
                    self._look()
                    look()
                    sleep(LOOK_S)
        finally:
            self._end()
        return self._summary()

    # --------------------------------------------------------------------------------------------------------- start

    def _start_all(self, should_end: Callable[[], bool], look: Callable[[], object]) -> bool:
        for node in self.nodes.values():
            if node.plan.is_by_hand:
                self._note(node, f"in a terminal of its own, start: autotelic {shlex.join(node.plan.words)}")
                continue
            self._start(node)
            end_s = self._now_s() + START_S
            while not self._is_up(node):
                look()
                if should_end():
                    return False
                if node.child is None or node.child.code is not None or self._now_s() > end_s:
                    words = "" if node.child is None else node.child.last_line
                    self._note(node, f"expected it to start within {START_S:g} s, it did not: {words}", Worst.FAILED)
                    return False
                sleep(LOOK_S)
        return True

    def _start(self, node: _Node) -> None:
        node.n_starts += 1
        node.begun_s = self._now_s()
        node.again_s, node.is_silent, node.is_faulted = None, False, False
        node.child = Child(node.plan, self._logs)
        self.book.begin(node.plan.name, node.child.pid)
        self._note(node, f"started as process {node.child.pid}")

    def _is_up(self, node: _Node) -> bool:
        """Whether it was heard; a job has some time of its own before it says anything."""
        self._join()
        return node.plan.kind == "job" or self.book.age_s(node.plan.name) is not None

    def _join(self) -> None:
        """Join the bus, once its hub is there."""
        if self._bus is not None:
            return
        bus = self._make_bus()
        try:
            bus.open()
        except BusError:
            return
        self._bus, self._stops = bus, StopCaller(bus, by="the supervisor")
        self._clock_asker = ClockAsker(bus, self.clocks)
        if self._night is not None:
            self._night.listen(bus, self._seconds)
        self._health = bus.subscriber(HEALTH, lambda received: self.book.take(received))

    # --------------------------------------------------------------------------------------------------------- watch

    def _bring_about(self) -> None:
        """Bring about what is due on purpose; a process that is away is left alone."""
        for fault in () if self._faults is None else self._faults.due(self._now_s()):
            node = self.nodes[fault.node]
            if node.child is None or node.child.code is not None:
                continue
            if fault.is_begin:
                node.is_faulted = True
                self._note(node, f"on purpose: {fault.what}")
            else:
                node.is_faulted = False
            node.child.send(fault.number)

    def _is_over(self) -> bool:
        return any(node.is_over for node in self.nodes.values())

    def _is_spent(self) -> bool:
        """Whether a run that nobody attends has to end; the arm is stopped first, as at every end."""
        if self._night is not None and self.why_over is None:
            self.why_over = self._night.why_over(self._seconds())
            if self.why_over is not None:
                robot = next(node for node in self.nodes.values() if node.plan.kind == "robot")
                self._note(robot, f"night: {self.why_over}: the run ends", Worst.FAILED)
        return self.why_over is not None

    def _seconds(self) -> float:
        return self._now_s() - self._begun_s

    def _look(self) -> None:
        for node in self.nodes.values():
            child = node.child
            if node.plan.is_by_hand:
                self._listen_by_hand(node)
            elif child is None:
                if node.again_s is not None and self._now_s() >= node.again_s:
                    self._start(node)
            elif child.code is not None:
                self._ended(node, child)
            else:
                self._listen(node, child)

    def _listen(self, node: _Node, child: Child) -> None:
        """Stop the arm where a process is silent, and end the process where it stays so."""
        name = node.plan.name
        is_unheard = node.plan.kind != "job" and self.book.age_s(name) is None
        if is_unheard and not self.book[name].is_leaving and self._now_s() - node.begun_s > START_S:
            self._note(node, f"not heard within {START_S:g} s of its start: it is killed", Worst.MENDED)
            child.kill()
            return
        if not self.book.is_silent(name, for_s=SILENT_S, hub=self._hub):
            if node.is_silent:
                node.is_silent = False
                self._note(node, "heard again")
            return
        if not node.is_silent:
            node.is_silent = True
            is_needed = node.plan.kind != SPARE
            self._note_away(node)
            self._note(node, f"silent for {SILENT_S:g} s{': the arm is stopped' if is_needed else ''}", Worst.MENDED)
            self._stop_arm(node)
        if self.book.is_silent(name, for_s=GONE_S, hub=self._hub):
            self._note(node, f"silent for {GONE_S:g} s: it is killed")
            child.kill()

    def _listen_by_hand(self, node: _Node) -> None:
        """Stop the arm where a process that a person started is silent; what ends it is that person's."""
        is_silent = self.book.is_silent(node.plan.name, for_s=SILENT_S, hub=self._hub)
        if is_silent and not node.is_silent:
            self._note(node, f"silent for {SILENT_S:g} s: look at its terminal", Worst.MENDED)
            self._stop_arm(node)
        elif node.is_silent and not is_silent and self.book.age_s(node.plan.name) is not None:
            self._note(node, "heard again")
        node.is_silent = is_silent

    def _ended(self, node: _Node, child: Child) -> None:
        code = node.code = child.code
        child.wait(1.0)
        node.child = None
        if node.plan.kind == "job" and code == 0:
            node.is_over = True
            self._note(node, "finished")
            return
        is_own = not node.is_faulted and is_own_end(node.plan.kind, self._now_s(), self._away_s)
        self._note_away(node)
        how = f"killed by signal {-code}" if code is not None and code < 0 else f"ended with exit code {code}"
        self._stop_arm(node)
        delay_s = None if code == USAGE else node.backoff.delay_s(self._now_s(), is_own=is_own)
        if delay_s is None:
            node.is_over = True
            self._note(node, f"{how} ({child.last_line}): it is given up", Worst.FAILED)
            return
        node.again_s = self._now_s() + delay_s
        self._note(node, f"{how} ({child.last_line}): it is started again in {delay_s:g} s", Worst.MENDED)

    def _note_away(self, node: _Node) -> None:
        """Note that a process is away, if it is one that the job needs."""
        if node.plan.kind not in (JOB, SPARE):
            self._away_s = self._now_s()

    def _stop_arm(self, node: _Node) -> None:
        """Say stop for a moment, unless the arm can do without that process: whoever holds it may be what ended."""
        if node.plan.kind == SPARE:
            return
        self._say_stop(within_s=NOW_S, is_final=False)

    def _say_stop(self, *, within_s: float, is_final: bool) -> float | None:
        robots = [node for node in self.nodes.values() if node.plan.kind == "robot"]
        is_there = any(self._is_there(node) for node in robots)
        if self._stops is None or not is_there:
            return None
        try:
            took_s = self._stops.stop(within_s=within_s, is_final=is_final)
        except BusError:
            took_s = None
        self._note(robots[0], f"stop {'not confirmed' if took_s is None else f'confirmed after {1e3 * took_s:.0f} ms'}")
        return took_s

    def _is_there(self, node: _Node) -> bool:
        if node.plan.is_by_hand:
            return self.book.age_s(node.plan.name) is not None
        return node.child is not None and node.child.code is None

    # ----------------------------------------------------------------------------------------------------------- end

    def _end(self) -> None:
        """The arm first, then who commands it, the arm again, who holds it, and all else backwards."""
        nodes = [node for node in self.nodes.values() if node.child is not None and node.child.code is None]
        others = [n for n in self.nodes.values() if n.plan.is_by_hand and n.plan.kind == "robot" and self._is_there(n)]
        is_final = not others  # a robot node that a person started goes on without us
        jobs = [node for node in nodes if node.plan.kind == "job"]
        for node in jobs:
            self._signal(node, signal.SIGINT)
        self._first_s = self._say_stop(within_s=STOP_S, is_final=is_final)
        for node in jobs:
            self._await(node, JOB_S)
        robots = [node for node in nodes if node.plan.kind == "robot"]
        self._last_s = self._say_stop(within_s=STOP_S, is_final=is_final)
        if (robots or others) and None in (self._first_s, self._last_s):
            self._note((*robots, *others)[0], "its stop was not confirmed: look at the arm", Worst.FAILED)
        rest = [node for node in reversed(nodes) if node not in jobs and node not in robots]
        for node in (*robots, *rest):
            self._signal(node, signal.SIGINT)
            self._await(node, END_S)
        if self._clock_asker is not None:
            self._clock_asker.close()
        if self._stops is not None and self._bus is not None:
            self._stops.close()
            self._bus.close()

    @staticmethod
    def _signal(node: _Node, number: signal.Signals) -> None:
        if node.child is not None:
            node.child.send(number)
            node.child.send(signal.SIGCONT)

    def _await(self, node: _Node, seconds: float) -> None:
        child = node.child
        if child is None:
            return
        if not child.wait(seconds):
            self._note(node, f"expected it to end within {seconds:g} s: it is killed", Worst.MENDED)
            child.kill()
        node.code = child.code
        self._note(node, f"ended with exit code {node.code}")
        if node.code not in (0, INTERRUPTED, -signal.SIGINT):
            self._raise(Worst.MENDED)

    def _note(self, node: _Node, what: str, worst: Worst = Worst.NOTHING) -> None:
        event = Event(at_s=round(self._now_s() - self._begun_s, 3), node=node.plan.name, what=what)
        self.events.append(event)
        self._logs.write("supervisor", f"{event.node}: {event.what}")
        self._tell(event)
        self._raise(worst)

    def _raise(self, worst: Worst) -> None:
        order = (Worst.NOTHING, Worst.MENDED, Worst.FAILED)
        self._worst = max(self._worst, worst, key=order.index)

    def _summary(self) -> Summary:
        nodes = []
        for name, node in self.nodes.items():
            heard = self.book[name]
            nodes.append(
                NodeSummary(
                    name=name, n_starts=node.n_starts, exit_code=node.code, most_late_ms=heard.most_late_ms,
                    most_mb=heard.most_mb, grown_mb=heard.most_mb - heard.first_mb, slope_mb_h=heard.slope.mb_h,
                    last_error="" if heard.health is None else heard.health.last_error,
                )
            )  # fmt: skip
        first_ms, last_ms = (None if took_s is None else 1e3 * took_s for took_s in (self._first_s, self._last_s))
        return Summary(
            rig=self._rig, seconds=self._now_s() - self._begun_s, exit_code=int(self._worst), nodes=tuple(nodes),
            events=tuple(self.events), stop_first_ms=first_ms, stop_last_ms=last_ms, logs=str(self._logs.folder),
            clocks=self.clocks.offsets(),
        )  # fmt: skip
