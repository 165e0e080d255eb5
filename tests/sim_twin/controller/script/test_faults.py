import pytest

from sim_twin.controller.script import Interpreter, Status, parse_program
from tests.support.scripts import ScriptRun, error_of, program


@pytest.mark.parametrize(
    ("statement", "says"),
    [
        ("x = later\n later = 1", "'later' has no value yet"),
        ("x = [1, 2]\nx[2] = 0", "index 2 is out of range, expected 0 to 1"),
        ("x = [1, 2][-1]", "index -1 is out of range"),
        ('x = [1]["a"]', "expected an integer as index, got the string 'a'"),
        ("x = 5\nx[0] = 1", "expected a list or a pose before [ ], got the integer 5"),
        ("x = True + 1", "the bool True + the integer 1 is not defined"),
        ("x = 1 / 0", "division by zero"),
        ('if ["yes"]:\n note(1)\n end', "expected True or False, got the list [yes]"),
        ("while [1]:\n sync()\n end", "expected True or False, got the list [1]"),
        ("x = p[1, 2, 3, 4, 5, True]", "expected numbers in p[ ], got the bool True"),
        ("x = struct(a=1)\ny = x.b", "no member 'b', it has a"),
        ("x = [1]\nx.shuffle()", "no method 'shuffle'"),
        ("x = [1]\nx.append()", "append() takes 1 arguments, got 0"),
        ("sin()", "sin() misses the argument 'f'"),
        ("sin(1, 2)", "sin() takes 1 arguments, got 2"),
        ("sin(angle=1)", "sin() has no parameter 'angle'"),
        ('sin("a")', "sin(): expected a number, got the string 'a'"),
        ("sqrt(-1)", "sqrt(): expected a number of 0 or more, got the integer -1"),
        ("sleep(True)", "sleep(): expected a number, got the bool True"),
        ('fail(message="expected a tool")', "fail(): expected a tool"),
        ('fail(message="zip() argument 2 is longer")', "fail(): expected other arguments, got the string 'zip()"),
        ("def f(a):\n end\n f()", "f() misses the argument 'a'"),
        ("def f(a):\n end\n f(1, 2)", "f() takes 1 arguments, got 2"),
        ("def f(a):\n end\n f(1, a=2)", "f() got the argument 'a' twice"),
        ("def f(a):\n end\n f(b=2)", "f() has no parameter 'b'"),
        ("def f():\n f()\n end\n f()", "f() calls itself too deep"),
        ("def f():\n end\n x = run f()", "expected the name of a thread after run, got 'f'"),
        ("thread t():\n end\n t()", "'t' is a thread, start it with run t()"),
        ('s = "ab"\nwhile True:\n s = str_cat(s, s)\n end', "the string is too long"),
        ('s = "ab"\nwhile True:\n s = s + s\n end', "the string is too long"),
        ("a = [1]\nwhile True:\n a = [a, a]\n end", "the list is too long"),
        ("a = [1, 2]\nwhile True:\n a[0] = a\n a[1] = a\n end", "the list is too long"),
        ("a = [1]\nwhile True:\n a.extend(a)\n end", "the list is too long"),
        ("a = make_list(1000000000, 0)", "at most 10000"),
        ("a = [1]\nwhile True:\n a = [[[[a]]]]\n sync()\n end", "nested too deep"),
        ("thread t():\n run t()\n end\n run t()\n sync()", "run t: expected at most 100 threads"),
        ("thread t():\n sync()\n sync()\n end\n while True:\n run t()\n end", "run t: expected at most 100 threads"),
        ('kill "a"', "expected a thread's handle after kill"),
        ("join [1]", "expected a thread's handle after join"),
    ],
)
def test_a_mistake_ends_the_program_and_says_what_it_was(statement, says):
    message, _ = error_of(program(statement))
    assert says in message


def test_the_line_is_that_of_the_statement():
    assert error_of("def prog():\n\n  # nothing\n  x = 1\n\n  x = 1 / 0\nend")[1] == 6


def test_the_line_of_a_condition_is_its_own():
    assert error_of("def prog():\n if False:\n  note(1)\n elif 1 / 0:\n  note(2)\n end\nend")[1] == 4


def test_after_a_call_the_line_is_the_callers_again():
    text = "def prog():\n def f():\n  note(1)\n  return 1\n end\n x = f() / 0\nend"
    assert error_of(text)[1] == 6


def test_the_line_of_an_error_inside_a_function_is_inside():
    assert error_of("def prog():\n def f():\n  note(1)\n  x = 1 / 0\n end\n f()\nend")[1] == 4


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("def prog():\n   x = 1 / 0\nend", (2, 4)),
        ("def prog():\n note(1); x = 1 / 0\nend", (2, 11)),
        ("def prog():\n global x = acos(2)\nend", (2, 2)),
        ("def prog():\n x = 1 +\n   acos(2)\nend", (2, 2)),
        ("def prog():\n if False:\n  note(1)\n elif 1 / 0:\n  note(2)\n end\nend", (4, 2)),
        ("def prog():\n  while 1 / 0:\n   note(1)\n end\nend", (2, 3)),
        ("def prog():\n def f():\n  note(1)\n  return 1\n end\n x = f() / 0\nend", (6, 2)),
        ("def prog():\n def f():\n  sync()\n  return 1\n end\n   x = f() / 0\nend", (6, 4)),
        ("def prog():\n def f():\n  note(1)\n    return 1 / 0\n end\n f()\nend", (4, 5)),
        ("def prog():\n thread t():\n  sync()\n    kill 1.5\n end\n run t()\n sync()\n sync()\nend", (4, 5)),
        ("x = 1\nx = 1 / 0\n", (2, 1)),
    ],
)
def test_the_place_of_a_mistake_is_where_its_statement_begins(text, place):
    error = ScriptRun(text).finish().interpreter.error
    assert (error.line, error.column) == place


def test_a_builtin_that_fails_after_some_slices_fails_at_its_call():
    def lift(height):
        yield
        raise ValueError(f"expected 3 m at most, got {height}")

    text = "def prog():\n note(1)\n lift(\n  9)\n note(2)\nend"
    assert error_of(text, lift=lift) == ("lift(): expected 3 m at most, got 9", 3)


def test_a_thread_that_fails_ends_the_whole_program():
    run = ScriptRun(program("thread t():\n sync()\n x = 1 / 0\n end\n run t()\n while True:\n note(1)\n sync()\n end"))
    run.finish()
    error = run.interpreter.error
    assert (run.interpreter.status, run.notes) == (Status.FAILED, [1, 1])
    assert (error.thread, error.line) == ("t", 4)


def test_a_program_that_failed_stays_so_and_runs_no_more():
    run = ScriptRun(program("note(1)\n x = 1 / 0")).step(5)
    assert run.notes == [1]
    assert run.interpreter.status is Status.FAILED


@pytest.mark.parametrize(
    "loop",
    [
        "while True:\n end",
        "while True:\n x = 1\n end",
        "while True:\n sleep(0)\n end",
        "while True:\n enter_critical\n exit_critical\n end",
        "while True:\n continue\n end",
        "def f():\n return True\n end\n while f():\n f()\n end",
    ],
)
def test_a_loop_that_never_takes_time_is_a_fault_in_its_first_slice(loop):
    run = ScriptRun(program(f"note(1)\n {loop}")).step()
    assert run.interpreter.status is Status.FAILED
    assert "'prog' used too much time" in run.interpreter.error.message
    assert "sync()" in run.interpreter.error.message


def counting(n_threads):
    """A program of threads that each count to 25 in every slice."""
    body = "while True:\n i = 0\n while i < 25:\n i = i + 1\n end\n sync()\n end"
    return program(f"thread t():\n{body}\nend\n{'run t()' * n_threads}\njoin run t()".replace(")r", ")\nr"))


def test_the_budget_is_for_each_slice_and_for_all_threads_of_a_program_together():
    assert ScriptRun(counting(2), slice_budget=1000).step(50).interpreter.status is Status.RUNNING
    many = ScriptRun(counting(20), slice_budget=1000).step()
    assert many.interpreter.status is Status.FAILED
    assert "'t' used too much time" in many.interpreter.error.message


def test_the_budget_ends_where_it_says():
    # 7 for the turn, 3 for i = 0 and 1 for the loop; 4 for the first test and for each round 5 and 4
    body = "i = 0\nwhile i < 9:\n i = i + 1\n end"
    assert ScriptRun(program(body), slice_budget=96).step().interpreter.status is Status.FINISHED
    assert ScriptRun(program(body), slice_budget=95).step().interpreter.status is Status.FAILED


@pytest.mark.parametrize("statement", ["sync()", "sleep(0.1)", 'move("a")', "def f():\n sync()\n end\n f()"])
def test_a_secondary_program_may_take_no_time(statement):
    message, _ = error_of(f"sec prog():\n {statement}\nend")
    assert "secondary program may not take physical time" in message


def test_a_secondary_program_that_takes_no_time_ends_in_its_slice():
    run = ScriptRun("sec prog():\n def f(x):\n  note(x)\n end\n f(3)\nend").step()
    assert run.interpreter.status is Status.FINISHED
    assert run.notes == [3]


def test_a_deep_recursion_through_expressions_is_a_fault_too():
    body = f"def f():\n return {'(1 + ' * 30}f(){')' * 30}\n end\n x = f()"
    message, _ = error_of(program(body))
    assert "too deep" in message


def test_a_builtin_that_hands_back_a_generator_must_be_a_generator_function():
    run = ScriptRun(program("odd()"), odd=lambda: iter_of()).step()
    assert "declare it as a generator function" in run.interpreter.error.message


class OddError(Exception):
    """What nobody foresaw."""


def fails():
    raise OddError("no room")


def fails_slowly():
    yield
    raise OddError("no room")


def fails_to_end():
    try:
        yield
    finally:
        raise OddError("no room")


@pytest.mark.parametrize("builtin", [fails, fails_slowly])
def test_whatever_a_builtin_raises_ends_the_program_and_not_the_controller(builtin):
    run = ScriptRun(program("note(1)\nodd()"), odd=builtin).finish()
    assert run.interpreter.status is Status.FAILED
    assert run.interpreter.error.message == "the controller failed at this, not the program: OddError('no room')"
    assert run.interpreter.error.line == 3


def test_what_a_builtin_raises_as_the_program_is_stopped_keeps_no_other_thread_alive():
    run = ScriptRun(program("thread t():\n odd()\n end\n run t()\n move(1, 9)"), odd=fails_to_end).step()
    run.interpreter.stop()
    assert (run.interpreter.status, run.notes) == (Status.FAILED, ["1 begins", "1 ends"])
    assert "no room" in run.interpreter.error.message


def iter_of():
    yield


def test_stop_ends_a_program_and_lets_its_builtins_clean_up():
    run = ScriptRun(program('thread t():\n move("b", 9)\n end\n run t()\n move("a", 9)')).step(2)
    run.interpreter.stop()
    run.interpreter.stop()
    assert run.interpreter.status is Status.FINISHED
    assert run.notes == ["a begins", "b begins", "a ends", "b ends"]
    assert run.step().notes[4:] == []


def test_the_line_of_the_main_thread_can_be_read_while_others_run():
    text = "def prog():\n thread t():\n  while True:\n   sync()\n  end\n end\n run t()\n sync()\n\n sync()\nend"
    run = ScriptRun(text)
    assert [run.step().interpreter.line for _ in range(2)] == [8, 10]


def test_an_interpreter_needs_no_builtins():
    interpreter = Interpreter(parse_program("def p():\n x = 1\nend"), {})
    assert interpreter.step() is Status.FINISHED


def test_the_line_after_a_wait_is_the_threads_own():
    text = 'def prog():\n thread t():\n  while True:\n   sync()\n  end\n end\n run t()\n x = move("m", 3) + 1\nend'
    assert error_of(text)[1] == 8


def test_after_a_call_that_took_time_the_line_is_the_callers_again():
    text = "def prog():\n def f():\n  sync()\n  return 1\n end\n x = f() / 0\nend"
    assert error_of(text)[1] == 6


def test_a_variable_assigned_before_its_global_exists_is_not_that_global():
    message, line = error_of(
        "def prog():\n def f():\n  a = 1\n end\n def g():\n  note(a)\n end\n f()\n g()\n a = 5\nend"
    )
    assert "'a' has no value yet" in message
    assert line == 6
