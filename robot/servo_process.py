"""The process that holds an arm: motion, gate and client, and nothing else. It ticks as long as it is in command.

Between intents it holds the arm at rest, so that the controller's watchdog is fed by commands that passed the gate, and
by nothing else. When the pipe to its station closes it stops the arm and ends. After a loss of the arm it ends too: the
client library must never get the chance to reconnect and go on by itself.
"""

from multiprocessing.connection import Connection

import msgspec

from config.arm import Tool
from config.resolved import Resolved
from robot.errors import RobotError, SafetyError
from robot.hal.protocols import Plant
from robot.messages import ArmState, GripCommand, Verdict
from robot.rigs import build_plant
from robot.safety import Reason
from robot.servo_messages import (
    BeginEpoch,
    Close,
    Connect,
    Connected,
    Done,
    Engage,
    Failure,
    Outputs,
    Reply,
    Request,
    Seed,
    Seeded,
    Stop,
    StrideReply,
    StrideRequest,
    unpack_intent,
)
from robot.tick_loop import TickLoop

__all__ = ["ServoServer", "serve"]

IDLE_S = 0.002
"""How long a process that is not in command waits for a request at a time."""
WIRE_REASONS = (Reason.STALE_STATE.value,)


def serve(connection: Connection, resolved_json: bytes) -> None:
    """Run a servo process until its station lets go of it.

    Args:
        connection: the pipe to the station.
        resolved_json: everything the rig is made of.
    """
    resolved = msgspec.json.decode(resolved_json, type=Resolved)
    plant = build_plant(rig=resolved.rig, arm=resolved.arm, scenario=resolved.scenario)
    loop = TickLoop(
        arm=plant.arm, config=resolved.arm, scenario=resolved.scenario, rule_sets=resolved.rule_sets, rig=resolved.rig
    )
    server = ServoServer(connection=connection, plant=plant, loop=loop, tool=resolved.arm.tool)
    try:
        server.run()
    except (EOFError, OSError, KeyboardInterrupt):
        pass  # the station is gone; the arm is stopped below
    finally:
        loop.close()
        connection.close()


class ServoServer:
    """Answers one station's requests, and ticks in between.

    Attributes:
        n_ticks: Ticks run so far; a station that watches it sees the process at work.
    """

    def __init__(self, *, connection: Connection, plant: Plant, loop: TickLoop, tool: Tool) -> None:
        self._connection, self._plant, self._loop, self._tool = connection, plant, loop, tool
        self._decode = msgspec.msgpack.Decoder(Request).decode
        self._encode = msgspec.msgpack.Encoder().encode
        self._is_in_command = self._is_over = False
        self._grip: GripCommand | None = None
        self._n_left = 0
        self.n_ticks = 0

    def run(self) -> None:
        """Serve until closed, or until the arm was lost."""
        while not self._is_over:
            is_ticking = self._is_in_command and self._grip is not None
            if is_ticking:
                self._tick()
            while not self._is_over and self._connection.poll(0.0 if is_ticking else IDLE_S):
                self._answer(self._decode(self._connection.recv_bytes()))
                is_ticking = True

    def _tick(self) -> None:
        assert self._grip is not None, "seeding sets it"
        verdict = self._loop.tick(self._grip)
        self.n_ticks += 1
        if self._n_left:
            self._n_left -= 1
            if verdict is not None or not self._n_left:
                self._end_stride(verdict)
        elif verdict is not None:
            self._lose(verdict)

    def _end_stride(self, verdict: Verdict | None) -> None:
        self._n_left = 0
        self._send(StrideReply(stride=self._loop.report(verdict, is_begun=True)))
        if verdict is None:
            self._loop.rest()
        else:
            self._lose(verdict)

    def _lose(self, verdict: Verdict) -> None:
        """Command is gone after a refusal; after a loss of the arm so is this process."""
        self._is_in_command = False
        self._is_over = verdict.reason in WIRE_REASONS

    def _answer(self, request: Request) -> None:
        if isinstance(request, StrideRequest):
            self._begin_stride(request)
            return
        try:
            reply = self._obey(request)
        except RobotError as error:
            reply = Failure(kind=type(error).__name__, message=str(error))
        self._send(reply)

    def _begin_stride(self, request: StrideRequest) -> None:
        if not self._is_in_command:
            self._send(Failure(kind=SafetyError.__name__, message="expected an engaged arm; engage and seed it first"))
            return
        self._grip = request.grip
        intent = unpack_intent(request.intent)
        verdict = self._loop.begin(intent, n_ticks=request.n_ticks, is_hand_busy=request.is_hand_busy)
        if verdict is None:
            self._n_left = request.n_ticks
            return
        self._send(StrideReply(stride=self._loop.report(verdict, is_begun=False)))
        self._lose(verdict)

    def _obey(self, request: Request) -> Reply:
        match request:
            case Connect():
                self._loop.connect()
                return Connected(identity=self._plant.identity)
            case Engage():
                self._loop.engage()
            case Seed():
                return Seeded(state=self._seed())
            case BeginEpoch(epoch=epoch):
                return Outputs(bits=self._loop.begin_epoch(epoch))
            case Stop():
                self._is_in_command = False
                self._plant.arm.stop()
            case Close():
                self._is_over = True
            case StrideRequest():
                raise AssertionError("answered elsewhere")
        return Done()

    def _seed(self) -> ArmState:
        state = self._loop.seed()
        opening_m = min(max(state.grip.opening_m, 0.0), self._tool.stroke_m)
        self._grip = GripCommand(
            opening_m=opening_m, force_n=self._tool.grip_force_n, speed_m_s=self._tool.speed_m_s[0]
        )
        self._loop.rest()
        self._is_in_command = True
        return state

    def _send(self, reply: Reply) -> None:
        self._connection.send_bytes(self._encode(reply))
