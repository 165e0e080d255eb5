import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_twin.controller.modes import (
    Event,
    Modes,
    MotionOrder,
    PowerTimes,
    ProgramOrder,
    Reaction,
    RobotMode,
    RuntimeState,
    SafetyMode,
    StopCategory,
)

TIMES = PowerTimes(n_power_on=10, n_brake_release=5, n_stop_at_most=20)
STOPPED, PLAYING, PAUSED = RuntimeState.STOPPED, RuntimeState.PLAYING, RuntimeState.PAUSED


def tick(modes, n=1, *, is_standing=True):
    return [modes.tick(is_standing=is_standing) for _ in range(n)][-1]


def running(**settings):
    modes = Modes(times=TIMES, **settings)
    modes.handle(Event.BRAKE_RELEASE)
    tick(modes, 15)
    assert modes.robot is RobotMode.RUNNING
    return modes


def playing(**settings):
    modes = running(**settings)
    assert modes.handle(Event.PLAY).program is ProgramOrder.START
    tick(modes)
    return modes


def after(*events):
    """A controller that runs a program and to which things happened; it came to rest."""
    modes = playing()
    for event in events:
        modes.handle(event)
        tick(modes, 3)
    return modes


def test_power_comes_up_in_its_time():
    modes = Modes(times=TIMES)
    assert modes.robot is RobotMode.POWER_OFF
    assert modes.robot_status_bits == 0
    modes.handle(Event.POWER_ON)
    tick(modes, 9)
    assert modes.robot is RobotMode.POWER_ON
    tick(modes)
    assert (modes.robot, modes.robot_status_bits) == (RobotMode.IDLE, 0b01)
    tick(modes, 100)
    assert modes.robot is RobotMode.IDLE
    modes.handle(Event.BRAKE_RELEASE)
    assert tick(modes, 4).motion is MotionOrder.NONE
    assert tick(modes).motion is MotionOrder.ENGAGE
    assert modes.robot is RobotMode.RUNNING


def test_brake_release_powers_on_by_itself():
    modes = Modes(times=TIMES)
    modes.handle(Event.BRAKE_RELEASE)
    tick(modes, 14)
    assert modes.robot is RobotMode.IDLE
    assert tick(modes).motion is MotionOrder.ENGAGE


def test_asking_twice_for_the_brakes_does_not_start_their_time_anew():
    modes = Modes(times=TIMES)
    modes.handle(Event.POWER_ON)
    tick(modes, 10)
    modes.handle(Event.BRAKE_RELEASE)
    tick(modes, 3)
    modes.handle(Event.BRAKE_RELEASE)
    tick(modes, 2)
    assert modes.robot is RobotMode.RUNNING


@pytest.mark.parametrize(
    ("events", "robot", "safety", "runtime", "bits"),
    [
        ((), RobotMode.RUNNING, SafetyMode.NORMAL, PLAYING, 1 << 0),
        ((Event.PAUSE,), RobotMode.RUNNING, SafetyMode.NORMAL, PAUSED, 1 << 0),
        ((Event.STOP,), RobotMode.RUNNING, SafetyMode.NORMAL, STOPPED, 1 << 0),
        ((Event.PROGRAM_ENDED,), RobotMode.RUNNING, SafetyMode.NORMAL, STOPPED, 1 << 0),
        ((Event.PAUSE, Event.PLAY), RobotMode.RUNNING, SafetyMode.NORMAL, PLAYING, 1 << 0),
        ((Event.POWER_OFF,), RobotMode.POWER_OFF, SafetyMode.NORMAL, STOPPED, 1 << 0),
        ((Event.REDUCED,), RobotMode.RUNNING, SafetyMode.REDUCED, PLAYING, 1 << 1),
        ((Event.REDUCED, Event.REDUCED_ENDED), RobotMode.RUNNING, SafetyMode.NORMAL, PLAYING, 1 << 0),
        ((Event.PROTECTIVE_STOP,), RobotMode.RUNNING, SafetyMode.PROTECTIVE_STOP, PAUSED, 1 << 2 | 1 << 10),
        ((Event.SAFEGUARD_OPENED,), RobotMode.RUNNING, SafetyMode.SAFEGUARD_STOP, PAUSED, 1 << 4 | 1 << 10),
        ((Event.SYSTEM_ESTOP,), RobotMode.POWER_OFF, SafetyMode.SYSTEM_EMERGENCY_STOP, STOPPED, 0b10010100000),
        ((Event.ROBOT_ESTOP,), RobotMode.POWER_OFF, SafetyMode.ROBOT_EMERGENCY_STOP, STOPPED, 0b10011000000),
        ((Event.VIOLATION,), RobotMode.POWER_OFF, SafetyMode.VIOLATION, STOPPED, 1 << 8 | 1 << 10),
        ((Event.FAULT,), RobotMode.POWER_OFF, SafetyMode.FAULT, STOPPED, 1 << 9 | 1 << 10),
        ((Event.ROBOT_ESTOP, Event.ROBOT_ESTOP_RELEASED), RobotMode.POWER_OFF, SafetyMode.NORMAL, STOPPED, 1 << 0),
        ((Event.SYSTEM_ESTOP, Event.SYSTEM_ESTOP_RELEASED), RobotMode.POWER_OFF, SafetyMode.NORMAL, STOPPED, 1 << 0),
        ((Event.FAULT, Event.RESTART_SAFETY), RobotMode.POWER_OFF, SafetyMode.NORMAL, STOPPED, 1 << 0),
        ((Event.VIOLATION, Event.RESTART_SAFETY), RobotMode.POWER_OFF, SafetyMode.NORMAL, STOPPED, 1 << 0),
        ((Event.SAFEGUARD_OPENED, Event.SAFEGUARD_CLOSED), RobotMode.RUNNING, SafetyMode.NORMAL, PLAYING, 1 << 0),
        (
            (Event.PROTECTIVE_STOP, Event.ROBOT_ESTOP),
            RobotMode.POWER_OFF,
            SafetyMode.ROBOT_EMERGENCY_STOP,
            STOPPED,
            None,
        ),
        ((Event.REDUCED, Event.PROTECTIVE_STOP), RobotMode.RUNNING, SafetyMode.PROTECTIVE_STOP, PAUSED, None),
    ],
)
def test_where_events_lead(events, robot, safety, runtime, bits):
    modes = after(*events)
    assert (modes.robot, modes.safety, modes.runtime) == (robot, safety, runtime)
    assert bits is None or modes.safety_status_bits == bits


@pytest.mark.parametrize(
    ("event", "reaction"),
    [
        (Event.STOP, (MotionOrder.STOP, ProgramOrder.STOP, StopCategory.STOP_AND_HOLD)),
        (Event.PAUSE, (MotionOrder.PAUSE, ProgramOrder.PAUSE, StopCategory.STOP_AND_HOLD)),
        (Event.PROTECTIVE_STOP, (MotionOrder.STOP, ProgramOrder.PAUSE, StopCategory.STOP_AND_HOLD)),
        (Event.SAFEGUARD_OPENED, (MotionOrder.PAUSE, ProgramOrder.PAUSE, StopCategory.STOP_AND_HOLD)),
        (Event.ROBOT_ESTOP, (MotionOrder.STOP, ProgramOrder.STOP, StopCategory.STOP_THEN_CUT)),
        (Event.SYSTEM_ESTOP, (MotionOrder.STOP, ProgramOrder.STOP, StopCategory.STOP_THEN_CUT)),
        (Event.VIOLATION, (MotionOrder.CUT, ProgramOrder.STOP, StopCategory.CUT)),
        (Event.FAULT, (MotionOrder.CUT, ProgramOrder.STOP, StopCategory.CUT)),
        (Event.POWER_OFF, (MotionOrder.CUT, ProgramOrder.STOP, StopCategory.CUT)),
        (Event.REDUCED, (MotionOrder.NONE, ProgramOrder.NONE, None)),
    ],
)
def test_what_must_be_done(event, reaction):
    done = playing().handle(event)
    assert (done.motion, done.program, done.category) == reaction
    assert done.refusal is None


@pytest.mark.parametrize(
    ("events", "event"),
    [
        ((), Event.POWER_ON),
        ((), Event.BRAKE_RELEASE),
        ((), Event.PLAY),
        ((Event.PAUSE,), Event.PAUSE),
        ((Event.STOP,), Event.PAUSE),
        ((Event.STOP,), Event.STOP),
        ((Event.STOP,), Event.PROGRAM_ENDED),
        ((Event.POWER_OFF,), Event.PLAY),
        ((Event.PROTECTIVE_STOP,), Event.PLAY),
        ((Event.PROTECTIVE_STOP,), Event.UNLOCK_PROTECTIVE_STOP),
        ((), Event.UNLOCK_PROTECTIVE_STOP),
        ((Event.SAFEGUARD_OPENED,), Event.PLAY),
        ((Event.SAFEGUARD_OPENED,), Event.SAFEGUARD_RESET),
        ((Event.ROBOT_ESTOP,), Event.POWER_ON),
        ((Event.ROBOT_ESTOP,), Event.BRAKE_RELEASE),
        ((Event.ROBOT_ESTOP,), Event.RESTART_SAFETY),
        ((Event.FAULT,), Event.POWER_ON),
        ((Event.VIOLATION,), Event.BRAKE_RELEASE),
        ((), Event.ROBOT_ESTOP_RELEASED),
        ((), Event.REDUCED_ENDED),
    ],
)
def test_what_is_forbidden_changes_nothing_and_says_why(events, event):
    modes = after(*events)
    before = (modes.robot, modes.safety, modes.runtime, modes.safety_status_bits)
    reaction = modes.handle(event)
    assert reaction.refusal
    assert reaction == Reaction(refusal=reaction.refusal)
    assert (modes.robot, modes.safety, modes.runtime, modes.safety_status_bits) == before


def test_a_program_that_stops_is_stopping_while_the_arm_moves():
    modes = playing()
    modes.handle(Event.STOP)
    tick(modes, 50, is_standing=False)
    assert modes.runtime is RuntimeState.STOPPING
    tick(modes)
    assert modes.runtime is STOPPED


def test_a_pause_is_pausing_while_the_arm_moves_and_resuming_for_a_slice():
    modes = playing()
    modes.handle(Event.PAUSE)
    tick(modes, 50, is_standing=False)
    assert (modes.runtime, modes.may_move) == (RuntimeState.PAUSING, True)
    tick(modes)
    assert (modes.runtime, modes.may_move) == (PAUSED, False)
    reaction = modes.handle(Event.PLAY)
    assert (reaction.motion, reaction.program) == (MotionOrder.RESUME, ProgramOrder.RESUME)
    assert modes.runtime is RuntimeState.RESUMING
    tick(modes, is_standing=False)
    assert modes.runtime is PLAYING


@pytest.mark.parametrize(("n", "is_unlocked"), [(2499, False), (2500, True)])
def test_a_protective_stop_is_unlocked_five_seconds_after_it_and_by_nobody_on_its_own(n, is_unlocked):
    modes = playing()
    modes.handle(Event.PROTECTIVE_STOP)
    assert not modes.may_move
    tick(modes, n)
    assert modes.safety is SafetyMode.PROTECTIVE_STOP
    reaction = modes.handle(Event.UNLOCK_PROTECTIVE_STOP)
    assert reaction.refusal == (None if is_unlocked else Modes.TOO_EARLY)
    assert (modes.safety is SafetyMode.NORMAL) is is_unlocked
    assert modes.runtime is PAUSED, "the program waits to be resumed"


def test_a_second_protective_stop_does_not_start_the_five_seconds_anew():
    modes = playing()
    modes.handle(Event.PROTECTIVE_STOP)
    tick(modes, 2000)
    modes.handle(Event.PROTECTIVE_STOP)
    tick(modes, 500)
    assert modes.handle(Event.UNLOCK_PROTECTIVE_STOP).refusal is None


def test_more_than_fifty_protective_stops_of_a_joint_are_a_fault():
    modes = running()
    for _ in range(50):
        modes.handle(Event.PROTECTIVE_STOP, joint=2)
    modes.handle(Event.PROTECTIVE_STOP, joint=3)
    assert modes.safety is SafetyMode.PROTECTIVE_STOP
    assert modes.handle(Event.PROTECTIVE_STOP, joint=2).motion is MotionOrder.CUT
    assert modes.safety is SafetyMode.FAULT


def test_a_safeguard_with_reset_waits_for_it():
    modes = playing(needs_safeguard_reset=True)
    modes.handle(Event.SAFEGUARD_OPENED)
    tick(modes, 5)
    modes.handle(Event.SAFEGUARD_CLOSED)
    assert modes.safety is SafetyMode.SAFEGUARD_STOP
    assert modes.handle(Event.SAFEGUARD_RESET).program is ProgramOrder.RESUME
    tick(modes)
    assert (modes.safety, modes.runtime) == (SafetyMode.NORMAL, PLAYING)


def test_a_safeguard_resumes_only_what_it_paused():
    modes = after(Event.PAUSE, Event.SAFEGUARD_OPENED)
    assert modes.handle(Event.SAFEGUARD_CLOSED) == Reaction()
    tick(modes)
    assert modes.runtime is PAUSED


def test_a_safeguard_does_not_resume_through_a_protective_stop():
    modes = after(Event.SAFEGUARD_OPENED, Event.PROTECTIVE_STOP)
    assert modes.handle(Event.SAFEGUARD_CLOSED).program is ProgramOrder.NONE
    assert modes.runtime is PAUSED


@pytest.mark.parametrize("between", [Event.PAUSE, Event.PROTECTIVE_STOP])
def test_a_safeguard_resumes_nothing_that_something_else_paused_meanwhile(between):
    modes = after(Event.SAFEGUARD_OPENED, between)
    tick(modes, 2500)
    modes.handle(Event.UNLOCK_PROTECTIVE_STOP)
    assert modes.handle(Event.SAFEGUARD_CLOSED).program is ProgramOrder.NONE
    assert tick(modes, 5).program is ProgramOrder.NONE
    assert modes.runtime is PAUSED


def test_a_safeguard_that_closes_while_the_arm_slows_down_resumes_once_it_rests():
    modes = playing()
    modes.handle(Event.SAFEGUARD_OPENED)
    tick(modes, 5, is_standing=False)
    assert modes.handle(Event.SAFEGUARD_CLOSED) == Reaction()
    tick(modes, 5, is_standing=False)
    assert modes.runtime is RuntimeState.PAUSING
    assert tick(modes).program is ProgramOrder.RESUME
    assert modes.runtime is RuntimeState.RESUMING


def test_a_safeguard_that_closes_while_no_program_runs_lets_motion_go_on():
    modes = running()
    modes.handle(Event.SAFEGUARD_OPENED)
    tick(modes, 5)
    reaction = modes.handle(Event.SAFEGUARD_CLOSED)
    assert (reaction.motion, reaction.program) == (MotionOrder.RESUME, ProgramOrder.NONE)
    assert modes.handle(Event.PLAY).motion is MotionOrder.RESUME


def test_an_emergency_stop_cuts_when_the_arm_stands_or_after_its_time():
    modes = playing()
    modes.handle(Event.ROBOT_ESTOP)
    tick(modes, 5, is_standing=False)
    assert modes.robot is RobotMode.RUNNING
    assert tick(modes).motion is MotionOrder.CUT
    assert modes.robot is RobotMode.POWER_OFF
    modes = playing()
    modes.handle(Event.ROBOT_ESTOP)
    assert tick(modes, 19, is_standing=False).motion is MotionOrder.NONE
    assert tick(modes, is_standing=False).motion is MotionOrder.CUT


def test_a_button_let_go_at_once_leaves_no_power_either():
    modes = playing()
    modes.handle(Event.ROBOT_ESTOP)
    assert modes.handle(Event.ROBOT_ESTOP_RELEASED).motion is MotionOrder.CUT
    assert (modes.robot, modes.safety) == (RobotMode.POWER_OFF, SafetyMode.NORMAL)


def test_power_that_is_coming_up_is_lost_by_an_emergency_stop():
    modes = Modes(times=TIMES)
    modes.handle(Event.BRAKE_RELEASE)
    tick(modes, 12)
    modes.handle(Event.SYSTEM_ESTOP)
    tick(modes, 50)
    assert modes.robot is RobotMode.POWER_OFF


@given(st.lists(st.sampled_from([*Event, None, "moving"]), max_size=60))
def test_whatever_happens_nothing_moves_under_a_stop(events):
    modes = running()
    for event in events:
        if isinstance(event, Event):
            modes.handle(event)
        else:
            modes.tick(is_standing=event is None)
        if modes.is_stopped_by_safety:
            assert modes.runtime not in (PLAYING, RuntimeState.RESUMING)
            assert modes.safety_status_bits & 1 << 10
        if modes.safety in (SafetyMode.FAULT, SafetyMode.VIOLATION):
            assert modes.robot is RobotMode.POWER_OFF
        if modes.may_move:
            assert modes.robot is RobotMode.RUNNING
