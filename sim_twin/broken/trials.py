"""The faults that an arm under way is put through, and what is expected of each."""

import os
import signal
from collections.abc import Callable
from enum import StrEnum
from time import monotonic, sleep
from typing import Any

import msgspec

from sim_twin.broken.pendant import Pendant
from sim_twin.broken.proof import Shows, shows_bias, shows_dh, shows_lag, shows_late, shows_noise, shows_weight
from sim_twin.broken.rider import Rider
from sim_twin.controller.process import ask_fault
from sim_twin.controller.wire.wires import GRIPPER

__all__ = ["JOG_RAD", "TOLD_S", "TRIALS", "Moment", "Stage", "Trial"]

JOG_RAD = 0.3
TOLD_S = 0.1
"""How soon whatever stops the arm must be told."""
BEGINS_S = 5.0
"""A program begins within so long of the word that takes command."""


class Moment(StrEnum):
    """What the backend is about when it happens."""

    RIDE = "ride"
    STOP = "stop"
    ENGAGE = "engage"
    SEED = "seed"


class Stage(msgspec.Struct, frozen=True, kw_only=True):
    """What a trial acts on."""

    host: str
    rider: Rider
    pendant: Pendant
    answers: dict[str, dict[str, object]] = msgspec.field(default_factory=dict[str, dict[str, object]])
    """What each fault said when it was brought about last."""

    def fault(self, name: str, **numbers: object) -> float:
        """Bring a fault about, and return when it was (s, the host's monotonic time)."""
        answer = self.answers[name] = ask_fault(self.host, name, **numbers)
        return float(str(answer["at_s"]))


def _nothing(_: Stage) -> None: ...


class Trial(msgspec.Struct, frozen=True, kw_only=True):
    """One fault."""

    name: str
    begin: Callable[[Stage], float]
    """Brings it about and returns when it was."""
    end: Callable[[Stage], Any] = _nothing
    """Ends it: the link is restored, the stop's cause is gone."""
    person: Callable[[Stage], Any] = _nothing
    """What a person does before anybody may take the arm again."""
    during: Moment = Moment.RIDE
    after_s: float = 0.2
    """How long after command was asked for it happens, where that is the moment."""
    ends_process: bool = False
    """The stop cannot be confirmed, and the process that held the arm must end for it."""
    is_stop: bool = True
    """It must be told, and the arm must come to rest; else it may be borne."""
    shows: Shows | None = None
    """Tells off the wire that it was there, where it is borne; None where only `barred_by` can."""
    begins_s: float = 0.0
    """How long after it a stop may begin, where commands were still under way."""
    hold_s: float = 0.4
    """How long it lasts after it was told."""
    is_jogged: bool = False
    """Somebody moves the joints meanwhile, at the pendant."""
    bars: bool = False
    """While it lasts nobody may take the arm."""
    barred_by: str = ""
    """Words that must be in what refuses it."""
    is_brief: bool = False
    """Part of the short bench."""


def _by(name: str, **numbers: object) -> Callable[[Stage], float]:
    def bring(stage: Stage) -> float:
        return stage.fault(name, **numbers)

    return bring


def _cut(stage: Stage) -> float:
    stage.fault("refuse", on=True)
    return stage.fault("drop")


def _cut_as_it_begins(stage: Stage) -> float:
    """Cut everything as the client's program begins to run: nobody has armed its watchdog yet."""
    end_s = monotonic() + BEGINS_S
    was_playing = True
    while monotonic() < end_s:
        is_playing = ask_fault(stage.host, "truth")["runtime"] == "PLAYING"
        if is_playing and not was_playing:
            break
        was_playing = is_playing
    return stage.fault("drop")


def _localise(stage: Stage) -> float:
    """Take remote control away, so that nobody but a person can end a program that the safeguard then pauses."""
    stage.fault("remote", on=False)
    return stage.fault("safeguard_open")


def _delocalise(stage: Stage) -> None:
    stage.fault("safeguard_close")
    sleep(0.5)
    stage.fault("remote", on=True)


def _hang(stage: Stage) -> float:
    """Let the servo process stand still in the middle of whatever it does."""
    pid = stage.rider.client.pid
    assert pid is not None, "it rides"
    os.kill(pid, signal.SIGSTOP)
    return monotonic()


def _unlock(stage: Stage) -> None:
    stage.pendant.unlock()


def _power_up(stage: Stage) -> None:
    stage.pendant.power_up()


def _running(script: str) -> Callable[[Stage], float]:
    """Have somebody else's script run."""

    def bring(stage: Stage) -> float:
        at_s = monotonic()
        stage.pendant.run(script)
        return at_s

    return bring


def _end_program(stage: Stage) -> None:
    stage.pendant.say("stop")


def _restart(stage: Stage) -> None:
    stage.pendant.restart()


def _short_freeze(stage: Stage) -> float:
    """Freeze for less than the watchdog waits, so that what was sent meanwhile is still read by a running program."""
    at_s = stage.fault("freeze", on=True)
    sleep(0.06)
    stage.fault("freeze", on=False)
    return at_s


_OTHER = "def other():\n while True:\n  sync()\n end\nend\n"
_TOOL = "sec tool():\n set_tcp(p[0, 0, 0.4, 0, 0, 0])\nend\n"
_LOAD = "sec load():\n set_payload(3.0, [0, 0, 0.05])\nend\n"
_REGISTERS = ["input_int_register_0"]
_BIAS_RAD = (0.02, 0.0, 0.0, 0.0, 0.0, 0.0)
TRIALS: tuple[Trial, ...] = (
    Trial(name="link_dropped", begin=_by("drop")),
    Trial(
        name="link_cut_3s_and_jogged", begin=_cut, end=_by("refuse", on=False), hold_s=3.0, is_jogged=True, bars=True,
        is_brief=True,
    ),
    Trial(name="cut_during_stop", begin=_by("drop"), during=Moment.STOP, hold_s=1.0),
    Trial(
        name="cut_3s_during_stop", begin=_cut, end=_by("refuse", on=False), during=Moment.STOP,
        hold_s=3.0, bars=True,
    ),
    Trial(name="cut_during_engage", begin=_by("drop"), during=Moment.ENGAGE, hold_s=1.0),
    Trial(name="cut_at_once_during_engage", begin=_by("drop"), during=Moment.ENGAGE, after_s=0.05, hold_s=1.0),
    Trial(name="cut_between_clients", begin=_by("drop"), during=Moment.ENGAGE, after_s=0.5, hold_s=1.0),
    Trial(name="cut_during_second_client", begin=_by("drop"), during=Moment.ENGAGE, after_s=0.75, hold_s=1.0),
    Trial(
        name="frozen_between_clients", begin=_by("freeze", on=True), end=_by("freeze", on=False), during=Moment.ENGAGE,
        after_s=0.5, hold_s=1.0,
    ),
    Trial(name="cut_as_program_begins", begin=_cut_as_it_begins, during=Moment.ENGAGE, hold_s=1.0, is_brief=True),
    Trial(name="cut_between_engage_and_seed", begin=_by("drop"), during=Moment.SEED, hold_s=1.0),
    Trial(name="rtde_dropped", begin=_by("drop", port=30004)),
    Trial(name="link_late_200ms", begin=_by("delay", ms=200), end=_by("delay", ms=0), begins_s=0.26),
    Trial(
        name="link_late_20ms", begin=_by("delay", ms=20), end=_by("delay", ms=0), is_stop=False, shows=shows_lag(0.02)
    ),
    Trial(
        name="interfaces_frozen_1s", begin=_by("freeze", on=True), end=_by("freeze", on=False), hold_s=1.0,
        is_brief=True,
    ),
    Trial(name="interfaces_frozen_60ms", begin=_short_freeze, begins_s=0.06),
    Trial(
        name="all_frozen_1s", begin=_by("freeze_all", on=True), end=_by("freeze_all", on=False), hold_s=1.0,
        begins_s=0.1,
    ),
    Trial(name="protective_stop", begin=_by("protective_stop"), person=_unlock, bars=True),
    Trial(name="emergency_stop", begin=_by("estop"), end=_by("estop_release"), person=_power_up, bars=True),
    Trial(name="safeguard_open", begin=_by("safeguard_open"), end=_by("safeguard_close"), bars=True, is_brief=True),
    Trial(
        name="local_control_then_safeguard", begin=_localise, end=_delocalise, hold_s=2.0, bars=True,
        ends_process=True,
    ),
    Trial(name="safety_violation", begin=_by("violation"), person=_restart, bars=True),
    Trial(name="controller_fault", begin=_by("fault"), person=_restart, bars=True),
    Trial(name="program_stopped", begin=_by("program_stop")),
    Trial(name="program_replaced", begin=_running(_OTHER), end=_end_program, bars=True),
    Trial(name="tool_set_by_another", begin=_running(_TOOL), begins_s=TOLD_S),  # the port that tells does so at 10 Hz
    Trial(name="payload_set_by_another", begin=_running(_LOAD)),
    Trial(name="gripper_dropped", begin=_by("drop", port=GRIPPER), begins_s=TOLD_S),
    Trial(
        name="gripper_silent", begin=_by("freeze", on=True, port=GRIPPER), end=_by("freeze", on=False, port=GRIPPER),
        begins_s=TOLD_S, hold_s=1.0, bars=True, barred_by="gripper",
    ),
    Trial(name="servo_process_hung_and_jogged", begin=_hang, hold_s=0.6, is_jogged=True, is_brief=True),
    Trial(
        name="speed_slider_lowered", begin=_by("slider", share=0.3), end=_by("slider", share=1.0), bars=True,
    ),
    Trial(name="reduced_mode", begin=_by("reduced", on=True), end=_by("reduced", on=False), bars=True),
    Trial(
        name="remote_control_off", begin=_by("remote", on=False), end=_by("remote", on=True), is_stop=False, bars=True,
        barred_by="remote control",
    ),
    Trial(
        name="register_in_use", begin=_by("reserve", names=_REGISTERS), end=_by("reserve"), is_stop=False, bars=True,
        barred_by="in use",
    ),
    Trial(name="ticks_late_80ms", begin=_by("late", ms=80.0), end=_by("late"), hold_s=0.2),
    Trial(
        name="ticks_late_3ms", begin=_by("late", ms=3.0, every=3), end=_by("late"), is_stop=False,
        shows=shows_late(0.003, every=3),
    ),
    Trial(
        name="joints_noisy_1mrad", begin=_by("noise", rad=0.001), end=_by("noise"), is_stop=False,
        shows=shows_noise(0.001),
    ),
    Trial(name="joints_biased_300mrad", begin=_by("bias", rad=[0.3, 0, 0, 0, 0, 0]), end=_by("bias")),
    Trial(
        name="joints_biased_20mrad", begin=_by("bias", rad=_BIAS_RAD), end=_by("bias"), is_stop=False,
        shows=shows_bias(_BIAS_RAD),
    ),
    Trial(
        name="payload_3kg_too_light", begin=_by("payload", kg=3.0), end=_by("payload"), is_stop=False,
        shows=shows_weight(3.0),
    ),
    Trial(
        name="calibrated_1mm", begin=_by("calibrate", mm=1.0, mrad=1.0), end=_by("calibrate"), is_stop=False,
        shows=shows_dh(1.0, 1.0),
    ),
    Trial(
        name="calibrated_80mrad", begin=_by("calibrate", mm=1.0, mrad=80.0), end=_by("calibrate"), is_stop=False,
        bars=True, barred_by="another model", shows=shows_dh(1.0, 80.0),
    ),
)  # fmt: skip
"""In the order in which they are run; each leaves the controller as it found it."""
