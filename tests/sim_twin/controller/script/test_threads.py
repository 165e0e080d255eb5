"""Each schedule is worked out by hand: (slice, what was noted in it)."""

from functools import partial

import pytest

from sim_twin.controller.script import Status
from sim_twin.controller.script.threads import Wait
from tests.support.scripts import Log, ScriptRun, program, schedule

COUNTER = """
thread count():
    i = 0
    while True:
        i = i + 1
        note(i)
        sync()
    end
end
"""


def test_sync_takes_the_rest_of_the_slice():
    assert schedule('note("a")\nsync()\nnote("b")\nsync()\nnote("c")') == [(1, "a"), (2, "b"), (3, "c")]


def test_sleep_counts_slices():
    # 0.01 s are five slices of 2 ms; 5.5 slices are six.
    assert schedule("sleep(0.01)\nnote(1)\nsleep(0.011)\nnote(2)\nsleep(0)\nnote(3)") == [(6, 1), (12, 2), (12, 3)]


def test_a_motion_takes_its_slices_and_returns_a_value():
    assert schedule('note(move("m", 2))') == [(1, "m begins"), (3, "m ends"), (3, "m")]


def test_time_may_pass_in_the_middle_of_an_expression():
    body = 'x = [move("a", 1), move("b", 1) == "b" and True, 3]\nnote(x)'
    assert schedule(body)[-1] == (3, ["a", True, 3])


def test_time_may_pass_in_conditions_arguments_defaults_and_indexes():
    body = """
    def waited(value):
        sync()
        return value
    end
    def f(a, b=waited(2)):
        return a + b
    end
    if waited(True):
        note("if")
    end
    i = 0
    while waited(i < 2):
        i = i + 1
    end
    note("while")
    x = [0, 0]
    x[waited(1)] = waited(f(waited(5)))
    note(x)
    """
    assert schedule(body) == [(2, "if"), (5, "while"), (9, [0, 7])]


def test_threads_run_in_the_order_of_their_start_once_a_slice():
    body = """
    thread a():
        note("a1")
        sync()
        note("a2")
    end
    thread b():
        note("b1")
        sync()
        note("b2")
    end
    run b()
    run a()
    note("m1")
    sync()
    note("m2")
    sync()
    note("m3")
    """
    assert schedule(body) == [(1, "m1"), (1, "b1"), (1, "a1"), (2, "m2"), (2, "b2"), (2, "a2"), (3, "m3")]


def test_a_thread_does_not_run_before_its_starter_lets_go():
    assert schedule('thread t():\n note("t")\n end\n run t()\n note("m")\n sync()') == [(1, "m"), (1, "t")]


def test_the_end_of_the_main_thread_ends_the_others_at_once():
    assert schedule(f"{COUNTER}\nrun count()\nsync()\nsync()\nnote(99)") == [(1, 1), (2, 2), (3, 99)]


def test_kill_ends_a_thread_before_its_turn_in_the_same_slice():
    body = f"{COUNTER}\nt = run count()\nsync()\nkill t\nnote(99)\nsync()\nnote(100)"
    assert schedule(body) == [(1, 1), (2, 99), (3, 100)]


def test_kill_lets_the_motion_of_the_thread_clean_up():
    body = 'thread t():\n move("m", 9)\n end\n h = run t()\n sync()\n kill h\n note("killed")'
    assert schedule(body) == [(1, "m begins"), (2, "m ends"), (2, "killed")]


def test_kill_of_no_thread_and_of_an_ended_one_does_nothing():
    assert schedule('kill 0\nthread t():\n x = 1\n end\n h = run t()\n sync()\n kill h\n kill h\n note("on")') == [
        (2, "on")
    ]


def test_a_thread_may_kill_itself():
    body = 'h = 0\nthread t():\n note("t")\n kill h\n note("never")\n end\n h = run t()\n sync()\n sync()\n note("m")'
    assert schedule(body) == [(1, "t"), (3, "m")]


def test_join_goes_on_in_the_slice_in_which_the_thread_ends():
    body = 'thread t():\n note("t1")\n sync()\n note("t2")\n end\n h = run t()\n join h\n note("joined")'
    assert schedule(body) == [(1, "t1"), (2, "t2"), (2, "joined")]


def test_join_of_an_ended_thread_does_not_wait():
    body = 'thread t():\n x = 1\n end\n h = run t()\n sync()\n join h\n note("on")'
    assert schedule(body) == [(2, "on")]


def test_handles_differ_from_zero_and_from_each_other():
    body = "thread t():\n sync()\n end\n a = run t()\n b = run t()\n note(a != 0)\n note(a != b)"
    assert schedule(body) == [(1, True), (1, True)]


def test_a_thread_has_its_own_locals():
    body = """
    global n = 0
    thread t():
        n = n + 1
        mine = n
        sync()
        note(mine)
    end
    run t()
    run t()
    sync()
    sync()
    """
    assert schedule(body) == [(2, 1), (2, 2)]


def test_the_same_program_twice_gives_the_same_schedule():
    body = f"{COUNTER}\nrun count()\nrun count()\nsleep(0.02)\nnote(99)"
    assert schedule(body) == schedule(body)


def test_a_blocking_popup_waits_until_it_is_closed():
    log = Log(n_open=2)
    run = ScriptRun(program('popup("read me", title="T", blocking=True)\nnote(1)'), log=log).finish()
    assert run.by_slice == [(3, 1)]
    assert [(popup.text, popup.title, popup.is_blocking) for popup in log.popups] == [("read me", "T", True)]


def test_textmsg_joins_two_values_as_text():
    run = ScriptRun(program('textmsg("at ", p[1, 2, 3, 0, 0, 0.5])\ntextmsg([1, True])')).finish()
    assert run.log.lines == ["at p[1, 2, 3, 0, 0, 0.5]", "[1, True]"]
    assert run.interpreter.status is Status.FINISHED


def test_a_loop_with_time_in_it_may_be_broken_and_what_follows_runs():
    first = 'while True:\n sync()\n break\n end\n note("after")'
    second = 'while True:\n sync()\n note("on")\n sync()\n break\n end\n note("last")'
    body = f"{first}\n{second}"
    assert schedule(body) == [(2, "after"), (3, "on"), (4, "last")]


def test_the_depth_of_calls_is_each_threads_own():
    body = """
    def down(n):
        if n > 0:
            down(n - 1)
        else:
            sync()
            sync()
        end
    end
    thread t():
        down(40)
    end
    run t()
    run t()
    down(40)
    note("up")
    """
    assert schedule(body) == [(3, "up")]


def test_a_function_may_be_called_more_often_than_calls_may_be_open():
    body = """
    def f():
        sync()
    end
    def g():
        x = 1
    end
    i = 0
    while i < 60:
        f()
        g()
        i = i + 1
    end
    note(i)
    """
    assert ScriptRun(program(body)).finish().by_slice == [(61, 60)]


def test_a_default_that_takes_time_takes_it():
    body = "def waited():\n sync()\n return 2\n end\n def f(a=waited()):\n return a\n end\n note(f())\n note(f(3))"
    assert schedule(body) == [(2, 2), (2, 3)]


class Lift:
    """Takes two slices, as a method, as an object and with an argument bound."""

    def up(self, height=1):
        yield
        yield
        return height

    __call__ = up


@pytest.mark.parametrize("builtin", [Lift().up, Lift(), partial(Lift().up, height=1)])
def test_whatever_is_a_generator_when_called_may_take_time(builtin):
    assert schedule("note(lift())", lift=builtin) == [(3, 1)]


def test_a_wait_for_something_outside_holds_nobody_off():
    def read():
        for _ in range(3):
            yield Wait.OUTSIDE
        return 7

    body = """
    thread t():
        while True:
            note("t")
            sync()
        end
    end
    run t()
    enter_critical
    got = read()
    note(got)
    exit_critical
    """
    assert schedule(body, read=read) == [(1, "t"), (2, "t"), (3, "t"), (4, 7)]
