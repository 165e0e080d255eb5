"""What is shown while a run goes on, and how it is asked to stop."""

import io

import pytest
from rich.console import Console

from learning.agent import EpochRecord
from learning.progress import Progress, Rate, Status, duration_text
from learning.stopwatch import Stopwatch
from tests.learning.test_metrics import row


class Clock:
    """A clock that a test winds."""

    def __init__(self):
        self.now_s = 0.0

    def __call__(self):
        return self.now_s


def record(epoch, goal, *, hit, void=False):
    return EpochRecord(epoch=epoch, goal=goal, is_achieved=hit, is_void=void, trials=())


def shown(*, terminal, clock):
    text = io.StringIO()
    console = Console(file=text, force_terminal=terminal, width=100)
    return text, Progress(goals=["red", "blue"], n_epochs=100, n_done=0, now_s=clock, console=console)


def test_without_a_terminal_a_plain_line_comes_every_ten_seconds():
    clock = Clock()
    text, progress = shown(terminal=False, clock=clock)
    with progress:
        for epoch in range(30):
            progress.epoch_begins(epoch, epoch % 2)
            clock.now_s += 1.0
            progress.epoch_ended(record(epoch, epoch % 2, hit=epoch % 2 == 0))
    lines = text.getvalue().splitlines()
    assert len(lines) == 2
    assert lines[0] == "epoch 10/100, goal red, recent success 100% 0%, 0 decisions/s, 1 min 30 s left"
    assert "\x1b" not in text.getvalue()


def test_evaluations_and_remarks_are_told_in_plain_lines():
    text, progress = shown(terminal=False, clock=Clock())
    with progress:
        progress.say("a worker died")
        progress.evaluated([row(50, 0, hits=10), row(50, 1, hits=20)])
    assert text.getvalue() == "a worker died\nevaluated at epoch 50: 50% 100%\n"


def test_on_a_terminal_a_bar_names_goal_success_and_time_left():
    clock = Clock()
    text, progress = shown(terminal=True, clock=clock)
    with progress:
        for epoch in range(5):
            clock.now_s += 1.0
            progress.epoch_begins(epoch, 1)
            progress.epoch_ended(record(epoch, 1, hit=True))
        progress.evaluated([row(50, 0, hits=10), row(50, 1, hits=20)])
        clock.now_s += 1.0
        progress.epoch_begins(5, 0)
    last = text.getvalue()
    assert "goal red" in last.replace("\x1b[1;36m", "").replace("\x1b[0m", "")
    assert "100%" in last
    assert "tested 50%" in last


def test_void_epochs_do_not_count_as_recent_success():
    _, progress = shown(terminal=False, clock=Clock())
    progress.epoch_ended(record(0, 0, hit=False, void=True))
    assert "success – –" in progress.line()


def test_a_rate_is_taken_over_its_window():
    rate = Rate(window_s=10.0)
    assert rate.per_s == 0.0
    for second in range(30):
        rate.mark(float(second), 2.0 * second if second < 15 else 30.0 + 5.0 * (second - 15))
    assert rate.per_s == pytest.approx(5.0)


@pytest.mark.parametrize(("seconds", "text"), [(0.4, "0 s"), (59.0, "59 s"), (200, "3 min 20 s"), (3900, "1 h 05 min")])
def test_durations_are_told_for_people(seconds, text):
    assert duration_text(seconds) == text


def test_a_stopwatch_books_time_to_the_layer_that_has_just_ended():
    clock = Clock()
    watch = Stopwatch(clock)
    for layer, seconds in (("experts", 1.0), ("stack", 2.0), ("experts", 0.5)):
        clock.now_s += seconds
        watch.lap(layer)
    with watch.all_booked_to("evaluation"):
        clock.now_s += 4.0
        watch.lap("stack")
        clock.now_s += 1.0
    assert watch.seconds_by_layer == {"experts": 1.5, "stack": 2.0, "evaluation": 5.0}


@pytest.mark.parametrize("terminal", [True, False])
@pytest.mark.parametrize("line", ["torn: runs/[v2]/a", "go on with: learn --out /tmp/m[/x]", "runs/:heart:/[bold]"])
def test_a_path_is_told_letter_by_letter(line, terminal):
    clock = Clock()
    text, progress = shown(terminal=terminal, clock=clock)
    with progress:
        progress.say(line)
    assert line in text.getvalue()
    told = io.StringIO()
    with Status(line, now_s=clock, console=Console(file=told, force_terminal=terminal, width=100)) as status:
        clock.now_s += 60.0
        status(line)
    assert line in told.getvalue()


@pytest.mark.parametrize(("terminal", "n_lines"), [(False, 2), (True, 0)])
def test_a_status_without_a_terminal_is_a_line_every_ten_seconds(terminal, n_lines):
    clock, text = Clock(), io.StringIO()
    with Status("testing", now_s=clock, console=Console(file=text, force_terminal=terminal, width=100)) as status:
        for n in range(30):
            clock.now_s += 1.0
            status(f"{n} test epochs run")
    told = [line for line in text.getvalue().splitlines() if line in ("9 test epochs run", "19 test epochs run")]
    assert len(told) == n_lines
