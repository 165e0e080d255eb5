"""Hears what changes on a controller while its arm is in somebody's command, and what no state that is read now shows.

Whoever sends a program replaces the one that obeys, between two readings of the runtime state: from then on nothing
watches over the link, for a watchdog dies with its program. And a `sec` program sets another tool while ours goes on.
Both are told on the primary interface: that a program was started once, by its name, the tool with every package, ten a
second. It is listened to from before our own program is uploaded, so that whose each start was is known.
"""

from time import monotonic_ns

from robot.errors import WireError
from robot.hal.primary_link import PrimaryLink
from robot.hal.programs_told import STARTED, ProgramsTold
from robot.hal.protocols import Clock
from robot.hal.ur_primary import PRIMARY_PORT, parse_key, parse_tool
from robot.messages import Vec6

__all__ = ["STARTED", "PrimaryWatch"]

SETTLE_S, N_SETTLED = 2.0, 2
"""What was told before the second state of the robot is of before we listened, or of before a tool was set."""
TOOL_TOLERANCE = 1e-4
"""Metres and radians."""
HUNG_UP = "its primary interface, which tells who starts a program there, hung up"


class PrimaryWatch:
    """Listens from `begin` to `close`, and tells at a `look` what has changed.

    Args:
        address: host or IP address of the controller.
        tool: the tool centre point that is to be set, metres and a rotation vector, flange frame.
        port: its primary interface's.

    Attributes:
        told: Who started what since `begin`, as far as `look` has heard.
    """

    def __init__(self, address: str, *, tool: Vec6, port: int = PRIMARY_PORT) -> None:
        self._link, self._tool = PrimaryLink(address, port=port), tool
        self.told = ProgramsTold()
        self._is_tool_set = self._is_deaf = False
        self._off_tool: Vec6 | None = None

    @property
    def is_open(self) -> bool:
        """Whether it listens."""
        return self._link.is_open

    def begin(self, clock: Clock) -> None:
        """Listen from now on; of what is told until the robot's second state only what runs then is kept.

        Raises:
            WireError: nobody answers, or nothing is told.
        """
        self._is_tool_set = self._is_deaf = False
        self._link.open()
        self.told = ProgramsTold()
        self._settle(clock)
        before, self.told = self.told, ProgramsTold()
        self.told.running = before.running

    def mind_tool(self, clock: Clock) -> None:
        """Tell of a tool other than ours from now on; what programs are told of meanwhile is heard.

        Raises:
            WireError: nothing is told.
        """
        self._settle(clock)
        self._is_tool_set, self._off_tool = True, None

    def look(self) -> tuple[bool, str] | None:
        """Return what has changed since, None for nothing. Does not wait.

        Returns:
            Whether what runs there now is not ours any more, and words for it.
        """
        self._hear()
        if self.told.foreign is not None:
            what = f"somebody started the program {self.told.foreign!r} on its controller"
            if self.told.is_ours:
                return False, f"{what}, and it has ended"
            return True, f"{what}, and what obeyed us has ended"
        if self._is_deaf or not self._link.is_open:
            return False, HUNG_UP
        if self._off_tool is not None:
            came = [round(value, 4) for value in self._off_tool]
            return False, f"somebody set another tool centre point: {came}, expected {list(self._tool)}"
        return None

    def close(self) -> None:
        """Listen no more. Idempotent."""
        self._link.close()

    def _settle(self, clock: Clock) -> None:
        (host, port), n_states, end_ns = self._link.at, 0, monotonic_ns() + round(SETTLE_S * 1e9)
        while n_states < N_SETTLED:
            if monotonic_ns() > end_ns:
                self.close()
                raise WireError(
                    f"primary interface: expected the robot's state from {host}:{port} ten times a second, it did not "
                    f"come {N_SETTLED} times in {SETTLE_S:g} s"
                )
            n_states += self._hear()
            if self._is_deaf:
                self.close()
                raise WireError(f"primary interface: {host}:{port} hung up")
            clock.wait_tick()

    def _hear(self) -> int:
        """Take in what has come. Returns how many states of the robot were in it."""
        packages = self._link.heard()
        if packages is None:
            self._is_deaf = True
            return 0
        tools = [tool for tool in map(parse_tool, packages) if tool is not None]
        for key in map(parse_key, packages):
            if key is not None:
                self.told.take(key)
        if self._is_tool_set:
            off = (t for t in tools if any(abs(a - b) > TOOL_TOLERANCE for a, b in zip(t, self._tool, strict=True)))
            self._off_tool = next(off, None)
        return len(tools)
