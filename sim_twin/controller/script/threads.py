"""Threads in physical slices: who runs in this slice, who waits, who holds the critical section.

A slice is one control period, 500 a second on a robot. In each, every live thread runs in the order in which the
threads were started until it takes time, waits or ends. A critical section holds the other threads off, over slices
too; when it opens, whoever was held off gets its turn in the same slice, before the section closes again: scripts
that leave a section only to enter it anew, as those of UR's own drivers do, would starve the others otherwise. Those
scripts also join threads and read from sockets within a section, and count on the others going on meanwhile: a section
holds nobody off while its holder waits for a thread or for something outside. Another may enter one meanwhile; then
the first, once it has what it waited for, is held off itself until the other leaves or waits: of those in a section
one goes on at a time.

What a slice may cost is counted, not timed, so that every run is the same: all threads of a program spend from one
budget, which every slice begins with.
"""

import enum
from collections.abc import Generator
from typing import TypeAlias, TypeVar

from sim_twin.controller.script.errors import ScriptRuntimeError
from sim_twin.controller.script.syntax import Place
from sim_twin.controller.script.values import Value

__all__ = ["Meter", "ProgramHalted", "Scheduler", "Steps", "Thread", "Wait"]

T = TypeVar("T")


_MAX_THREADS = 100
_TURN = 7
"""What a thread's turn costs beside what it executes."""
NOWHERE = Place(0, 0)


class Wait(enum.Enum):
    """Why a thread pauses without taking time; a plain yield of None takes the rest of its slice."""

    JOIN = 0
    GIVE_WAY = 1
    OUTSIDE = 2
    """For something outside, such as a socket: takes the rest of the slice too, but holds nobody off meanwhile."""


_LETS_RUN = (Wait.JOIN, Wait.OUTSIDE)
Steps: TypeAlias = Generator["Wait | None", None, T]


class ProgramHalted(Exception):  # noqa: N818 - no error: the script says halt
    """The script ended itself."""


class _ThreadEnded(Exception):  # noqa: N818 - no error: a thread killed itself
    """The running thread ended itself."""


class Meter:
    """What the running thread has used: read and written by compiled code, so plain attributes.

    Attributes:
        place: Where the statement that is being executed begins.
        left: What the program may still spend in this slice, in steps of some 0.1 µs of Python.
        depth: How many calls are open.
        name: The running thread's.
    """

    __slots__ = ("depth", "left", "name", "place")

    def __init__(self) -> None:
        self.place = NOWHERE
        self.left = 0
        self.depth = 0
        self.name = ""

    def spend(self, cost: int) -> None:
        """Take a cost off what is left.

        Raises:
            ScriptRuntimeError: there is not so much left.
        """
        self.left -= cost
        if self.left < 0:
            raise ScriptRuntimeError(
                f"the thread '{self.name}' used too much time in one slice, is this an infinite loop? "
                "Put sync() or sleep() into it"
            )


class Thread:
    """One thread: its work as a generator, its side of the meter while another runs, how many sections it is in."""

    __slots__ = ("depth", "is_alive", "n_sections", "name", "place", "work")

    def __init__(self, name: str, work: Steps[object], place: Place) -> None:
        self.name = name
        self.work = work
        self.place, self.depth = place, 0
        self.is_alive = True
        self.n_sections = 0


class Scheduler:
    """Owns the threads of one program.

    Attributes:
        running: The thread that runs now, or ran last.
    """

    def __init__(self, meter: Meter, *, slice_budget: int, may_take_time: bool) -> None:
        self._meter = meter
        self._budget = slice_budget
        self._may_take_time = may_take_time
        self._threads: dict[int, Thread] = {}  # live ones, in the order of their start
        self._n_started = self._n_started_in_slice = 0
        self._turn: list[Thread] = []
        self._main: Thread | None = None
        self._holder: Thread | None = None  # the one in a section that does not wait
        self._held_off: set[Thread] = set()
        self.running: Thread | None = None

    def start(self, name: str, work: Steps[object]) -> int:
        """Add a thread, which gets its first turn in this slice, and return its handle."""
        self._n_started_in_slice += 1
        if max(self._n_started_in_slice, len(self._threads)) > _MAX_THREADS:
            raise ScriptRuntimeError(f"run {name}: expected at most {_MAX_THREADS} threads, and starts in one slice")
        self._n_started += 1
        thread = Thread(name, work, self._meter.place)
        self._threads[self._n_started] = thread
        self._turn.append(thread)
        return self._n_started

    def start_main(self, name: str, work: Steps[object]) -> Thread:
        """Add the thread with which the program ends."""
        self._main = self._threads[self.start(name, work)]
        return self._main

    def kill(self, handle: Value) -> None:
        """End a thread; a handle of a thread that is no more, and 0, which names none, are let pass."""
        thread = self._thread(handle, "kill")
        if thread is None:
            return
        if thread is self.running:
            raise _ThreadEnded
        thread.work.close()
        self._end(thread)

    def is_alive(self, handle: Value) -> bool:
        """Return whether the thread has not ended."""
        return self._thread(handle, "join") is not None

    def stop(self) -> None:
        """End all threads; where one cannot clean up after itself, the others are ended all the same."""
        failures: list[Exception] = []
        for thread in list(self._threads.values()):
            self._end(thread)
            try:
                thread.work.close()
            except Exception as error:  # noqa: BLE001 - told below
                failures.append(error)
        if failures:
            raise failures[0]

    @property
    def is_contended(self) -> bool:
        """Whether a thread that the critical section held off, in this slice or before, still waits for its turn."""
        return bool(self._held_off)

    def enter(self) -> None:
        """Hold the other threads off; sections nest."""
        if self.running is not None:
            self.running.n_sections += 1

    def leave(self) -> None:
        """Leave one section; without one there is nothing to leave."""
        if self.running is not None and self.running.n_sections:
            self.running.n_sections -= 1

    def step(self) -> None:
        """Run one slice, or as much of it as there is before the main thread ends."""
        self._meter.left = self._budget
        self._turn = turn = list(self._threads.values())
        self._n_started_in_slice = 0
        while turn:
            again, is_any_ahead = self._round(turn)
            if not is_any_ahead:
                return
            self._turn = turn = again

    def _round(self, turn: list[Thread]) -> tuple[list[Thread], bool]:
        """Give each its turn; return who could not use it, and whether anybody did."""
        again: list[Thread] = []
        is_any_ahead = False
        for thread in turn:  # grows while threads are started
            if not thread.is_alive:
                continue
            if self._holder not in (None, thread):
                self._held_off.add(thread)
                again.append(thread)
                continue
            self._held_off.discard(thread)
            wait = self._advance(thread)
            self._holder = thread if thread.is_alive and thread.n_sections and wait not in _LETS_RUN else None
            if wait is not None and wait is not Wait.OUTSIDE:
                again.append(thread)
            is_any_ahead |= wait is not Wait.JOIN
            if self._main is not None and not self._main.is_alive:
                return [], False
        return again, is_any_ahead

    def _advance(self, thread: Thread) -> Wait | None:
        meter = self._meter
        meter.place, meter.depth, meter.name = thread.place, thread.depth, thread.name
        self.running = thread
        meter.spend(_TURN)
        try:
            wait = thread.work.send(None)
        except (StopIteration, _ThreadEnded):
            self._end(thread)
            return None
        finally:
            thread.place, thread.depth = meter.place, meter.depth
        if isinstance(wait, Wait) and wait is not Wait.OUTSIDE:
            return wait
        if not self._may_take_time:
            raise ScriptRuntimeError(
                "a secondary program may not take physical time: no sync, sleep or motion in a sec"
            )
        return wait

    def _thread(self, handle: Value, word: str) -> Thread | None:
        if type(handle) is not int:
            raise ScriptRuntimeError(f"expected a thread's handle after {word}, as run returns it")
        return self._threads.get(handle)

    def _end(self, thread: Thread) -> None:
        thread.is_alive = False
        self._threads = {handle: other for handle, other in self._threads.items() if other is not thread}
        self._held_off.discard(thread)
        if thread is self._holder:
            self._holder = None
