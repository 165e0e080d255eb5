"""Who presses and looks at a virtual table, over the bus."""

import time
from collections.abc import Callable
from types import TracebackType
from typing import Self

from robot.bus.queries import Asker
from robot.bus.session import Bus
from robot.bus.topic import Role
from robot.bus.topics import CELL, CellAction, CellTruth
from robot.cell_check import Wire

__all__ = ["VirtualSomebody"]

ACT_S, LOOK_S, POLL_S = 1.0, 3.0, 0.05
OPEN_SHARE, SHUT_SHARE = 0.9, 0.05


class VirtualSomebody:
    """Implements robot.cell_check.Somebody with the truth of the twin behind a virtual controller.

    Args:
        endpoint: Of the bus.
        serial: Of the virtual controller.
        keys: Folder of certificates, for an endpoint that asks for them.
    """

    def __init__(self, endpoint: str, serial: str, *, keys: str | None = None) -> None:
        self._bus = Bus(endpoint, serial=serial, role=Role.ROBOT, source="somebody", keys=keys)
        self._asker: Asker[CellAction, CellTruth] | None = None

    def __enter__(self) -> Self:
        """Join the bus.

        Raises:
            BusError: nobody listens there.
        """
        self._bus.open()
        self._asker = self._bus.asker(CELL)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bus.close()

    def press(self, wire: Wire, is_changed: Callable[[], bool]) -> None:
        """Press the button, or put a thing into the box."""
        self._act(wire, is_on=True)
        _await(is_changed, ACT_S)

    def release(self, wire: Wire, is_back: Callable[[], bool]) -> None:
        """Let go of it, or take the thing out."""
        self._act(wire, is_on=False)
        _await(is_back, ACT_S)

    def ready(self, wire: Wire) -> None:
        """Nobody has to be asked."""

    def saw(self, wire: Wire, *, is_on: bool) -> bool:
        """Return whether the lamp or the lid comes to be as asked."""
        return _await(lambda: self._is(wire, is_on=is_on), LOOK_S)

    def look(self) -> CellTruth:
        """Return which lamps are lit and how far lids are open."""
        return self._ask(CellAction())

    def _is(self, wire: Wire, *, is_on: bool) -> bool:
        seen = self.look()
        if wire.what == "lamp":
            return seen.lamps[wire.name] is is_on
        share = seen.lids[wire.name]
        return share > OPEN_SHARE if is_on else share < SHUT_SHARE

    def _act(self, wire: Wire, *, is_on: bool) -> None:
        self._ask(CellAction(name=wire.name, is_on=is_on))

    def _ask(self, action: CellAction) -> CellTruth:
        assert self._asker is not None, "entered"
        return self._asker.ask(action)


def _await(is_there: Callable[[], bool], timeout_s: float) -> bool:
    end_s = time.monotonic() + timeout_s
    while not is_there():
        if time.monotonic() > end_s:
            return False
        time.sleep(POLL_S)
    return True
