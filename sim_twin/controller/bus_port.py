"""The twin on the bus: its truth 100 times a second, and resets of its table. Polled by the controller's loop."""

import msgspec
import zenoh

from robot.bus import RESET, TRUTH, ResetRequest, open_session, topic
from robot.messages import SceneState
from sim_twin.controller.robot import VirtualRobot
from sim_twin.plant import TwinTruth

__all__ = ["BusPort"]

TRUTH_SLICES = 5
N_WAITING = 8


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
        self._encode = msgspec.json.Encoder().encode

    def tick(self, n_slices: int) -> None:
        """Answer what was asked, and publish when it is time."""
        query = self._queries.try_recv()
        if query is not None:
            self._answer(query)
        if n_slices % TRUTH_SLICES == 0:
            self._publisher.put(self._encode(self._read()))

    def close(self) -> None:
        """Leave the bus. Idempotent."""
        self._session.close()

    def _read(self) -> SceneState:
        return self._truth.read()

    def _answer(self, query: zenoh.Query) -> None:
        with query:
            try:
                payload = b"" if query.payload is None else query.payload.to_bytes()
                asked = msgspec.json.decode(payload, type=ResetRequest)
                self._robot.lay_out(seed=asked.seed, epoch=asked.epoch, digital_out=asked.digital_out)
            except (msgspec.DecodeError, ValueError) as error:
                query.reply_err(f"reset: {error}")
            else:
                query.reply(self._key, b"")
