"""The twin on the bus: its truth 100 times a second, and resets of its table. Polled by the controller's loop.

How all its bodies stand goes out too, 50 times a second, where a process reads it that renders a camera: a simulated
world has no light that would bring it there. Where none does, the loop is not held up by it.

Whoever resets the table of a cell also looks after an arm that has stopped: a protective stop is unlocked, when five
seconds have passed since, and the program that it interrupted is ended, before the table is laid out. Other stops stay.
A reset waits a second for a program that is ending and an arm that is coming to rest. What is no reset request is
answered with an error before anything else: it unlocks and ends nothing.
"""

from robot.bus import CELL, RESET, TRUTH, Asked, Bus, CellAction, CellTruth, ResetDone, ResetRequest, Role
from robot.bus.topics import TWIN_POSE
from robot.node import HealthTeller, Pulse
from sim_twin.controller.robot import VirtualRobot
from sim_twin.controller.table_hands import TableHands
from sim_twin.controller.wire.dashboard_target import Outcome
from sim_twin.plant import TwinTruth
from sim_twin.twin_pose import pose_of

__all__ = ["BusPort"]

TRUTH_SLICES, POSE_SLICES, SLICES_PER_S = 5, 10, 500.0
POSE_PHASE = 3
"""Truth goes out in other slices: two messages would make one of them twice as long."""
PATIENCE_SLICES = 500
"""How long a program may take to end, and the arm to come to rest, once a reset was asked for."""


_Reset = Asked[ResetRequest, ResetDone]


class BusPort:
    """The hub of the bus, in the process that holds the twin.

    Args:
        robot: Whose table it is.
        endpoint: Where to listen, such as tcp/127.0.0.2:7447.
        keys: Folder of certificates and their ledger, for an endpoint that asks for them.

    Raises:
        BusError: the endpoint is taken.
    """

    def __init__(self, robot: VirtualRobot, endpoint: str, *, keys: str | None = None) -> None:
        self._robot = robot
        self._truth = TwinTruth(robot.machine.world)
        serial = robot.panel.status().serial_number
        self._bus = Bus(endpoint, serial=serial, role=Role.TWIN, is_hub=True, keys=keys)
        self._bus.open()
        self._publisher, self._poses = self._bus.publisher(TRUTH), self._bus.publisher(TWIN_POSE)
        self._resets, self._actions = self._bus.answerer(RESET), self._bus.answerer(CELL)
        self._hands = TableHands(robot.machine.world)
        self._pulse = Pulse(target_hz=SLICES_PER_S)
        self._health = HealthTeller(self._bus, self._pulse)
        self._n_patience = 0
        self._asked: _Reset | None = None
        """A reset that waits for the arm to be unlocked, or to come to rest."""

    @property
    def is_waiting(self) -> bool:
        """Whether a reset was asked for that is not answered yet."""
        return self._asked is not None

    def tick(self, n_slices: int) -> None:
        """Answer what was asked, and publish when it is time."""
        self._pulse.beat()
        reset, self._asked = self._asked, None
        if reset is None:
            reset, self._n_patience = self._resets.next(), PATIENCE_SLICES
        if reset is not None:
            self._answer(reset)
        action = self._actions.next()
        if action is not None:
            self._act(action)
        if n_slices % TRUTH_SLICES == 0:
            self._publisher.put(self._truth.read())
        if n_slices % POSE_SLICES == POSE_PHASE and self._poses.is_read:
            self._poses.put(pose_of(self._robot.machine.world))

    def close(self) -> None:
        """Leave the bus. Idempotent."""
        self._health.close()
        self._bus.close()

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
        asked = reset.request
        try:
            robot.lay_out(seed=asked.seed, epoch=asked.epoch, digital_out=asked.digital_out)
        except ValueError as error:
            reset.refuse(f"reset: {error}")
        else:
            self._hands.let_go()
            reset.answer(ResetDone(seed=asked.seed, epoch=asked.epoch))

    def _act(self, action: Asked[CellAction, CellTruth]) -> None:
        asked = action.request
        try:
            if asked.name:
                self._hands.act(asked.name, is_on=asked.is_on)
        except ValueError as error:
            action.refuse(f"cell: {error}")
        else:
            action.answer(self._hands.look())
