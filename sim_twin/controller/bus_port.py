"""The twin on the bus: its truth 100 times a second, and resets of its table. Polled by the controller's loop.

Whoever resets the table of a cell also looks after an arm that has stopped: a protective stop is unlocked, when five
seconds have passed since, and the program that it interrupted is ended, before the table is laid out. Other stops stay.
A reset waits a second for a program that is ending and an arm that is coming to rest. What is no reset request is
answered with an error before anything else: it unlocks and ends nothing.
"""

from typing import NamedTuple

import msgspec
import zenoh

from robot.bus import CELL, RESET, TRUTH, CellAction, ResetRequest, open_session, topic
from robot.messages import SceneState
from sim_twin.controller.robot import VirtualRobot
from sim_twin.controller.table_hands import TableHands
from sim_twin.controller.wire.dashboard_target import Outcome
from sim_twin.plant import TwinTruth

__all__ = ["BusPort"]

TRUTH_SLICES = 5
N_WAITING = 8
PATIENCE_SLICES = 500
"""How long a program may take to end, and the arm to come to rest, once a reset was asked for."""


class _Reset(NamedTuple):
    query: zenoh.Query
    request: ResetRequest


class BusPort:
    """The hub of the bus, in the process that holds the twin.

    Args:
        robot: Whose table it is.
        endpoint: Where to listen, such as tcp/127.0.0.2:7447.

    Raises:
        BusError: the endpoint is taken.
    """

    def __init__(self, robot: VirtualRobot, endpoint: str) -> None:
        self._robot = robot
        self._truth = TwinTruth(robot.machine.world)
        serial = robot.panel.status().serial_number
        self._key = topic(serial, RESET)
        self._session = open_session(endpoint, is_hub=True)
        self._publisher = self._session.declare_publisher(
            topic(serial, TRUTH), congestion_control=zenoh.CongestionControl.DROP, express=True
        )
        self._queries = self._session.declare_queryable(self._key, zenoh.handlers.FifoChannel(N_WAITING))
        self._cell_key = topic(serial, CELL)
        self._actions = self._session.declare_queryable(self._cell_key, zenoh.handlers.FifoChannel(N_WAITING))
        self._hands = TableHands(robot.machine.world)
        self._n_patience = 0
        self._asked: _Reset | None = None
        """A reset that waits for the arm to be unlocked, or to come to rest."""
        self._encode = msgspec.json.Encoder().encode

    @property
    def is_waiting(self) -> bool:
        """Whether a reset was asked for that is not answered yet."""
        return self._asked is not None

    def tick(self, n_slices: int) -> None:
        """Answer what was asked, and publish when it is time."""
        reset, self._asked = self._asked, None
        if reset is None:
            reset, self._n_patience = self._next_reset(), PATIENCE_SLICES
        if reset is not None:
            self._answer(reset)
        action = self._actions.try_recv()
        if action is not None:
            self._act(action)
        if n_slices % TRUTH_SLICES == 0:
            self._publisher.put(self._encode(self._read()))

    def close(self) -> None:
        """Leave the bus. Idempotent."""
        self._session.close()

    def _read(self) -> SceneState:
        return self._truth.read()

    def _next_reset(self) -> _Reset | None:
        """Return what was asked next, None where nothing was or where it was garbage, which is answered here."""
        query = self._queries.try_recv()
        if query is None:
            return None
        try:
            return _Reset(query, msgspec.json.decode(_payload(query), type=ResetRequest))
        except (msgspec.DecodeError, ValueError) as error:
            with query:
                query.reply_err(f"reset: {error}")
            return None

    def _answer(self, reset: _Reset) -> None:
        robot, modes = self._robot, self._robot.machine.modes
        if modes.is_stopped_by_safety:
            if robot.panel.unlock_protective_stop() is Outcome.TOO_EARLY:
                self._asked = reset
                return
            robot.panel.stop()
            self._n_patience = PATIENCE_SLICES
        if self._n_patience and not robot.is_idle:
            self._asked = reset
            self._n_patience -= 1
            return
        query, asked = reset
        with query:
            try:
                robot.lay_out(seed=asked.seed, epoch=asked.epoch, digital_out=asked.digital_out)
            except ValueError as error:
                query.reply_err(f"reset: {error}")
            else:
                self._hands.let_go()
                query.reply(self._key, b"")

    def _act(self, query: zenoh.Query) -> None:
        with query:
            try:
                asked = msgspec.json.decode(_payload(query), type=CellAction)
                if asked.name:
                    self._hands.act(asked.name, is_on=asked.is_on)
            except (msgspec.DecodeError, ValueError) as error:
                query.reply_err(f"cell: {error}")
            else:
                query.reply(self._cell_key, self._encode(self._hands.look()))


def _payload(query: zenoh.Query) -> bytes:
    return b"" if query.payload is None else query.payload.to_bytes()
