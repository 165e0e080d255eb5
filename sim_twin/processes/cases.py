"""What befalls the processes that move an arm, and what is expected of each case."""

import json
import os
import signal
from collections.abc import Callable
from contextlib import suppress
from time import monotonic
from typing import Any

import msgspec
import zenoh

from robot.bus import RESET, TRUTH, key_of
from sim_twin.processes.commander import CommanderProcess, Order
from sim_twin.processes.relay import Relay

__all__ = ["CASES", "Case", "Stage"]

SOMEBODY = (
    b"\x00\xff garbage", b"{}", b'{"stamp_ns": 0, "objects": "none"}', b"[" * 2000, b'{"stamp_ns": NaN, "objects": []}',
)  # fmt: skip


class Stage(msgspec.Struct, frozen=True, kw_only=True):
    """What a case acts on."""

    commander: CommanderProcess
    relay: Relay
    endpoint: str
    """Of the bus's hub, past the relay."""
    serial: str

    def session(self) -> zenoh.Session:
        """Join the bus as anybody can who reaches it."""
        config = zenoh.Config()
        config.insert_json5("mode", '"client"')
        config.insert_json5("scouting/multicast/enabled", "false")
        config.insert_json5("scouting/gossip/enabled", "false")
        config.insert_json5("connect/endpoints", json.dumps([self.endpoint]))
        return zenoh.open(config)

    def signal(self, number: signal.Signals, *, servo: bool = False, commander: bool = True) -> float:
        """Send a signal and return when it was (s, the host's monotonic time)."""
        pids = [self.commander.pid] * commander + [self.commander.log.servo_pid] * servo
        at_s = monotonic()
        for pid in pids:
            os.kill(pid, number)
        return at_s

    def order(self, order: Order) -> float:
        """Have the commander misbehave; return when, at the latest."""
        self.commander.tell(order)
        return monotonic()


def _nothing(_: Stage) -> None: ...


class Case(msgspec.Struct, frozen=True, kw_only=True):
    """One case."""

    name: str
    begin: Callable[[Stage], float]
    """Brings it about and returns when it was."""
    end: Callable[[Stage], Any] = _nothing
    hold_s: float = 0.5
    """How long it lasts at least."""
    is_sudden: bool = True
    """The last good intent was sent before it; otherwise intents go on for a while, and their end is found."""
    is_deadly: bool = False
    """The commander is gone after it: another one is started, which nobody has armed."""
    is_brief: bool = False
    """Part of the short bench."""


def _by_signal(number: signal.Signals, *, servo: bool = False, commander: bool = True) -> Callable[[Stage], float]:
    return lambda stage: stage.signal(number, servo=servo, commander=commander)


def _by_order(order: Order) -> Callable[[Stage], float]:
    return lambda stage: stage.order(order)


def _cut(stage: Stage) -> float:
    at_s = monotonic()
    stage.relay.cut()
    return at_s


def _mend(stage: Stage) -> None:
    stage.relay.mend()


def _thaw(stage: Stage) -> None:
    stage.signal(signal.SIGCONT)
    with suppress(ProcessLookupError):  # it was killed for standing still
        stage.signal(signal.SIGCONT, servo=True, commander=False)


def besiege(stage: Stage) -> None:
    """Ask for motion, arming and the lease over the bus, in every way that somebody might believe in."""
    words = (*SOMEBODY, b'{"type":"Twist","linear_m_s":[0.0,0.3,0.0]}', b'{"by":"the bus","answer":"AAAA"}', b"arm")
    with stage.session() as session:
        for name in ("intent/learning", "intent/teleop", "arming", "lease", "station/arm", TRUTH.name, "twin/intent"):
            for word in words:
                session.put(key_of(stage.serial, name), word)
        for word in SOMEBODY:
            list(session.get(key_of(stage.serial, RESET.name), payload=word, timeout=1.0))


CASES: tuple[Case, ...] = (
    Case(
        name="commander_frozen_1s", begin=_by_signal(signal.SIGSTOP), end=_thaw, hold_s=1.0, is_brief=True,
    ),
    Case(name="commander_slow_300ms", begin=_by_order(Order.SLOW), is_sudden=False, hold_s=0.9, is_brief=True),
    Case(name="intent_not_a_number", begin=_by_order(Order.NAN), is_sudden=False),
    Case(name="garbage_bytes", begin=_by_order(Order.BYTES), is_sudden=False, is_brief=True),
    Case(name="garbage_schema", begin=_by_order(Order.SCHEMA), is_sudden=False),
    Case(name="message_torn", begin=_by_order(Order.TORN), is_sudden=False),
    Case(name="message_too_long", begin=_by_order(Order.LONG), is_sudden=False),
    Case(name="old_sequence", begin=_by_order(Order.OLD), is_sudden=False),
    Case(name="lease_of_another", begin=_by_order(Order.LEASE), is_sudden=False),
    Case(
        name="servo_process_killed", begin=_by_signal(signal.SIGKILL, servo=True, commander=False), is_brief=True,
    ),
    Case(
        name="servo_process_frozen", begin=_by_signal(signal.SIGSTOP, servo=True, commander=False), hold_s=1.0,
    ),
    Case(
        name="both_frozen_1s", begin=_by_signal(signal.SIGSTOP, servo=True), end=_thaw, hold_s=1.0,
    ),
    Case(name="bus_cut", begin=_cut, end=_mend, is_sudden=False, hold_s=1.0, is_brief=True),
    Case(name="commander_killed", begin=_by_signal(signal.SIGKILL), is_deadly=True, is_brief=True),
    Case(
        name="commander_and_servo_killed", begin=_by_signal(signal.SIGKILL, servo=True), is_deadly=True,
    ),
)  # fmt: skip
"""In the order in which they are run."""
