"""A shadow of an arm that runs: it reads every tick off the rig's bus, and says stop where a bound is passed. The edge.

It holds no lease and no part of the servo process; where it is late or killed the arm goes on without it.
"""

from collections.abc import Callable
from functools import partial
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any

from config.resolved import Resolved
from robot.bus import Bus, Received, Role, Topic
from robot.bus.tick_rows import unpack_ticks
from robot.bus.topics import PERCEPT, TICKS
from robot.errors import RobotConfigError
from robot.messages import ArmState
from robot.node.stop_caller import StopCaller
from robot.tick_ring import Tick
from sim_twin.shadowing.beside import Bounds, TwinBeside

__all__ = ["SOURCE", "BusShadow", "open_bus"]

SOURCE = "shadow"
POLL_S, TELL_S = 0.05, 0.25
STOP_S = 5.0


class BusShadow:
    """Follows a plant until it is told to end, or a bound latches.

    Args:
        bus: open; this process only looks there, and says stop.
        resolved: arm and table; its rig is the plant's.
        bounds: that latch.
        says_stop: whether a bound that is passed stops the arm; it latches here in any case.
        look: is called after every tick.

    Attributes:
        beside: The twin.
        n_ticks: Ticks that came.
        n_missed: Ticks that did not: they were lost on their way, or nobody read them in time.
        stopped_s: How long it took until a robot node confirmed the stop; None where none was said or confirmed.
    """

    def __init__(
        self, bus: Bus, resolved: Resolved, *, bounds: Bounds, says_stop: bool,
        look: Callable[[TwinBeside], object] = lambda _: None,
    ) -> None:  # fmt: skip
        self._look = look
        self.beside = TwinBeside(resolved, bounds=bounds)
        self._caller = StopCaller(bus, by=SOURCE) if says_stop else None
        self._came: SimpleQueue[tuple[Topic[Any], Received[Any]]] = SimpleQueue()
        self._subscribers = [
            bus.subscriber(TICKS, partial(self._note, TICKS)),
            bus.subscriber(PERCEPT, partial(self._note, PERCEPT)),
        ]
        self._state: ArmState | None = None
        self._first_missed: int | None = None
        self.n_ticks = self.n_missed = 0
        self.stopped_s: float | None = None

    def run(self, is_over: Callable[[], bool], *, tell: Callable[["BusShadow"], object] = lambda _: None) -> None:
        """Follow.

        Args:
            is_over: asked a few times a second.
            tell: is called a few times a second, to show how it is.

        Raises:
            BusError: ticks of another version came.
        """
        due_s = monotonic() + TELL_S
        while not is_over() and self.beside.latched is None:
            try:
                topic, received = self._came.get(timeout=POLL_S)
            except Empty:
                pass
            else:
                self._take(topic, received)
            if monotonic() >= due_s:
                due_s = monotonic() + TELL_S
                tell(self)
        if self.beside.latched is not None and self._caller is not None:
            self.stopped_s = self._caller.stop(within_s=STOP_S)
        tell(self)

    def close(self) -> None:
        """Listen no more. Idempotent."""
        for subscriber in self._subscribers:
            subscriber.close()
        if self._caller is not None:
            self._caller.close()

    def _note(self, topic: Topic[Any], received: Received[Any]) -> None:
        self._came.put((topic, received))

    def _take(self, topic: Topic[Any], received: Received[Any]) -> None:
        if topic is PERCEPT:
            self.beside.see(received.message)
            return
        batch = received.message
        if self._first_missed is None:
            self._first_missed = batch.n_missed
        self.n_missed = batch.n_missed - self._first_missed
        for tick in unpack_ticks(batch):
            self._follow(tick)
            if self.beside.latched is not None:
                return

    def _follow(self, tick: Tick) -> None:
        self.n_ticks += 1
        if tick.state is not None:
            self._state = tick.state
        if tick.verdict is not None or tick.command is None:
            self.beside.begin_anew()  # nothing was sent: the arm holds, or is stopped
        elif tick.state is not None:
            self.beside.take(tick.state, tick.command)
            self._look(self.beside)


def open_bus(resolved: Resolved, *, endpoint: str = "") -> Bus:
    """Return a rig's bus, not yet open, for who looks.

    Raises:
        RobotConfigError: the rig has none, or does not say whose it is.
    """
    rig = resolved.rig
    where = endpoint or rig.bus
    if where is None:
        raise RobotConfigError(
            f"rig {rig.name}: expected a bus, it has none: its processes are one; shadow a session of it with --session"
        )
    if not rig.expected.serial:
        raise RobotConfigError(f"rig {rig.name}: expected expected.serial, not filled in yet: topics are below it")
    return Bus(where, serial=rig.expected.serial, role=Role.VIEWER, source=SOURCE, keys=rig.keys)
