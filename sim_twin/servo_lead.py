"""Who asks a servo process for what the servo bench times: a station's side of the pipe, in a process of its own."""

from multiprocessing import get_context
from multiprocessing.connection import Connection
from time import monotonic

import msgspec

from config.resolved import Resolved
from config.scenario import Scenario
from robot.messages import GripCommand, Heading
from robot.servo_messages import (
    BeginEpoch,
    Close,
    Connect,
    Engage,
    Failure,
    Reply,
    Request,
    Seed,
    Seeded,
    Stop,
    StrideReply,
    StrideRequest,
    pack_intent,
)
from robot.surroundings import Place, Surroundings

__all__ = ["Lead"]

INTENT_TICKS, TURN_RAD, STEP_M, HEIGHT_M = 25, 0.3, 0.01, 0.2
"""A new intent every 50 ms, each turned from the one before: the tool goes round a circle of 7 cm."""
ANSWER_S, END_S = 30.0, 5.0
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


class Lead:
    """A process that leads the tool round a circle, a block at a time, over the pipe that a servo server answers.

    Args:
        resolved: the rig whose arm is led.

    Attributes:
        pipe: the server's end.
    """

    def __init__(self, resolved: Resolved) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self._orders, orders = context.Pipe()
        raw = msgspec.json.encode(resolved)
        self._process = context.Process(target=_lead, args=(theirs, orders, raw), daemon=True)
        self._process.start()
        theirs.close()
        orders.close()

    def begin(self, duration_s: float) -> None:
        """Have a block of so long led from now on. What an earlier one left unread is thrown away."""
        while self.pipe.poll(0.0):
            self.pipe.recv_bytes()
        self._orders.send(duration_s)

    def ended(self) -> str | None:
        """Return why the block ended before its time, None where it did not; once the server has been closed."""
        if not self._orders.poll(ANSWER_S):
            return "nobody led it any more"
        return self._orders.recv()

    def close(self) -> None:
        """End the process. Idempotent."""
        if self._process.is_alive():
            self._orders.send(None)
            self._process.join(END_S)
            self._process.kill()


def _lead(pipe: Connection, orders: Connection, resolved_json: bytes) -> None:
    leader = _Leader(pipe, msgspec.json.decode(resolved_json, type=Resolved))
    try:
        while (duration_s := orders.recv()) is not None:
            orders.send(leader.go(duration_s))
    except (EOFError, KeyboardInterrupt):
        pass  # the bench has ended


class _EndedError(Exception):
    """The block is over before its time; its text says why."""


class _Leader:
    def __init__(self, pipe: Connection, resolved: Resolved) -> None:
        self._pipe, self._tool = pipe, resolved.arm.tool
        self._places = _places_of(resolved.scenario)
        self._encode = msgspec.msgpack.Encoder().encode
        self._decode = msgspec.msgpack.Decoder(Reply).decode

    def go(self, duration_s: float) -> str | None:
        """Take the arm, lead it for so long, and give it back. Returns why it ended earlier, if it did."""
        while self._pipe.poll(0.0):
            self._pipe.recv_bytes()
        why = None
        try:
            for request in (Connect(), BeginEpoch(epoch=0), Engage()):
                self._ask(request)
            self._go_round(duration_s)
            self._ask(Stop())
        except _EndedError as error:
            why = str(error)
        self._send(Close())
        return why

    def _go_round(self, duration_s: float) -> None:
        seeded = self._ask(Seed())
        assert isinstance(seeded, Seeded), "what else there is ends the block"
        state = seeded.state
        grip = GripCommand(
            opening_m=min(max(state.grip.opening_m, 0.0), self._tool.stroke_m),
            force_n=self._tool.grip_force_n,
            speed_m_s=self._tool.speed_m_s[0],
        )
        heading_rad, sequence, until_s = 0.0, 0, monotonic() + duration_s
        while monotonic() < until_s:
            heading_rad, sequence = heading_rad + TURN_RAD, sequence + 1
            intent = Heading(heading_rad=heading_rad, distance_m=STEP_M, height_m=HEIGHT_M)
            told = self._ask(
                StrideRequest(
                    intent=pack_intent(intent),
                    grip=grip,
                    n_ticks=INTENT_TICKS,
                    sequence=sequence,
                    around=Surroundings(stamp_ns=state.stamp_ns, places=self._places),
                )
            )
            assert isinstance(told, StrideReply), "what else there is ends the block"
            state = told.stride.after

    def _ask(self, request: Request) -> Reply:
        """Return what is answered. Raises _EndedError for a refusal, a failure and silence."""
        self._send(request)
        if not self._pipe.poll(ANSWER_S):
            raise _EndedError(f"no answer to {type(request).__name__} within {ANSWER_S:g} s")
        reply = self._decode(self._pipe.recv_bytes())
        if isinstance(reply, Failure):
            raise _EndedError(f"{type(request).__name__}: {reply.kind}: {reply.message}")
        if isinstance(reply, StrideReply) and reply.stride.verdict is not None:
            verdict = reply.stride.verdict
            raise _EndedError(f"{verdict.reason}: {verdict.detail}")
        return reply

    def _send(self, request: Request) -> None:
        self._pipe.send_bytes(self._encode(request))


def _places_of(scenario: Scenario) -> tuple[Place, ...]:
    """Return where the things of a scenario stand by its file, in the order of Surroundings."""
    table_m = scenario.table.height_m
    boxes = {box.name: box.position_m for box in scenario.boxes}
    found = [(thing.position_m, thing.height_m) for thing in (*scenario.buttons, *scenario.boxes)]
    for cylinder in scenario.cylinders:
        x, y = boxes.get(cylinder.inside or "", (0.0, 0.0))
        found.append(((x + cylinder.position_m[0], y + cylinder.position_m[1]), cylinder.height_m))
    return tuple(Place(position_m=(x, y, table_m + height_m / 2.0), quat=UPRIGHT) for (x, y), height_m in found)
