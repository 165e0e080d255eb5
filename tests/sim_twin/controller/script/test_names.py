"""Names are looked up in all of a program before any of it runs."""

import pytest

from sim_twin.controller.script import Interpreter, ScriptNameError, parse_program
from tests.support.scripts import ScriptRun, program


def refused(text, **settings):
    """Return the name that is not found, and where."""
    with pytest.raises(ScriptNameError) as caught:
        Interpreter(parse_program(text), {"known": print}, **settings)
    error = caught.value
    head, name, tail = error.as_reported.split(":")
    assert (head, tail) == ("compile_error_name_not_found", "")
    assert f"'{name}' is not defined" in str(error)
    return name, error.line, error.column


@pytest.mark.parametrize(
    ("statements", "found"),
    [
        ("foo()", ("foo", 2, 1)),
        ("x = 1 + y", ("y", 2, 9)),
        ("y[0] = 1", ("y", 2, 1)),
        ("y.a = 1", ("y", 2, 1)),
        ("known(k=y)", ("y", 2, 9)),
        ("x = [p[1, 2, 3, 4, 5, y]]", ("y", 2, 23)),
        ("kill y", ("y", 2, 6)),
        ("x = run known()", ("known", 2, 9)),
        ("if False:\n foo()\nend", ("foo", 3, 2)),
        ("if True:\n known()\nelif y:\nelse:\n z()\nend", ("y", 4, 6)),
        ("while True:\n known(y)\nend", ("y", 3, 8)),
        ("while y:\nend", ("y", 2, 7)),
        ("def f():\n return y\nend", ("y", 3, 9)),
        ("def f(a=y):\nend", ("y", 2, 9)),
        ("thread t():\n foo()\nend", ("foo", 3, 2)),
        ("def f():\n def g():\n end\nend\ng()", ("g", 6, 1)),
        ("def f():\n local y = 1\nend\nknown(y)", ("y", 5, 7)),
        ("def f():\n y = 1\nend\ndef g():\n return y\nend", ("y", 6, 9)),
        ("b()\na()", ("b", 2, 1)),
    ],
)
def test_the_first_name_that_nothing_has_is_told_with_its_place(statements, found):
    assert refused(program(statements)) == found


@pytest.mark.parametrize(
    "statements",
    [
        "f()\ndef f():\nend",
        "def f():\n return late\nend\nlate = 1",
        "def f():\n global made = 1\nend\nnote(made)",
        "def f(a, b=a):\n a = b\nend",
        "def f():\n def g():\n  f()\n end\n g()\nend",
        "if False:\n never = 1\nend\nif False:\n note(never)\nend",
    ],
)
def test_what_is_assigned_or_defined_anywhere_in_sight_is_known(statements):
    ScriptRun(program(statements))


def test_variables_that_the_host_gives_are_known():
    Interpreter(parse_program("x = y"), {}, variables={"y": 1})
    assert refused("x = y")[0] == "y"
