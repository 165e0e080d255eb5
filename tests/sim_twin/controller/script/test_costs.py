"""What a slice may cost: counted, so these bounds are exact; how long the count takes is in test_speed."""

import pytest

from sim_twin.controller.script import DEFAULT_SLICE_BUDGET, Status
from tests.support.scripts import ScriptRun, error_of, program


def turns_of(statement, before="", **more):
    """Return how often a statement is executed before a loop of it alone ends the program, in its first slice."""
    run = ScriptRun(program(f"{before}\nwhile True:\nnote(0)\n{statement}\nend"), **more).step()
    assert "used too much time in one slice" in run.interpreter.error.message
    return len(run.notes)


def test_a_builtin_takes_what_it_was_measured_to_cost():
    run = {"slice_budget": 40_000, "costly": lambda: 0}
    cheap = turns_of("costly()", **run)
    assert 500 < cheap < 2000
    assert turns_of("costly()", costs={"costly": 5000}, **run) == 8


@pytest.mark.parametrize(
    ("before", "statement"),
    [
        ("l = make_list(9000, 1.5)", "m = l + l"),
        ("l = make_list(9000, 1.5)", "m = 2 * l"),
        ("l = make_list(9000, 1.5)", "m = -l"),
        ("l = make_list(9000, 1.5)", "m = l"),
        ("l = make_list(9000, 1.5)", "x = l == l"),
        ("l = make_list(9000, 1.5)", "m = l.slice(0, 9000)"),
        ("l = make_list(4000, 1.5)", "textmsg(l)"),
        ("l = make_list(9000, 1.5)", "x = length(l)"),
        ("l = make_list(9000, 1.5)", "def f(m):\n return 1\n end\n x = f(l)"),
        ("", "l = make_list(9000, 1.5)"),
        ("l = make_list(90, make_list(90, 1.5))", "m = transpose(l)"),
        ("l = make_list(15, make_list(15, 1.5))", "m = l * l"),
        ("l = make_list(9000, 1.5)", "s = struct(a=l)"),
        ("l = make_list(3000, 1.5)\nm = [0, 0]", "m[0] = l"),
        ("l = make_list(3000, 1.5)\nm = [0]", "m.append(l)\nm.pop()"),
    ],
)
def test_what_goes_through_a_long_list_costs_its_length(before, statement):
    # Each takes 100 µs to 2 ms, the budget is some 4 ms.
    assert turns_of(statement, before, slice_budget=DEFAULT_SLICE_BUDGET) <= 20


@pytest.mark.parametrize("statement", ["i = str_find(s, t)", "t = s + s", "x = s == t", "x = str_len(s)"])
def test_what_goes_through_a_long_string_costs_its_length(statement):
    before = 's = "0123456789abcdef"\ni = 0\nwhile i < 11:\n s = s + s\n i = i + 1\n end\nt = s + ""'
    assert turns_of(statement, before, slice_budget=DEFAULT_SLICE_BUDGET) < 170


def test_a_long_expression_costs_its_terms():
    terms = " + ".join(["1"] * 100)
    assert turns_of(f"x = {terms}", slice_budget=20_000) < 100
    tests = "".join(f"elif x == {i}:\n x = 1\n" for i in range(100))
    assert turns_of(f"if x == -1:\n x = 1\n{tests}end", "x = -2", slice_budget=20_000) < 100


def test_a_long_program_of_moves_costs_each_in_its_own_slice():
    run = ScriptRun(program('move("a", 1)\n' * 100), slice_budget=100).finish()
    assert run.interpreter.status is Status.FINISHED


@pytest.mark.parametrize(
    ("body", "says"),
    [
        ("l = make_list(5, make_list(5000, 0))", "at most 10000 elements"),
        ("s = struct(a=1)\nwhile True:\n s = struct(a=s, b=s)\n sync()\n end", "the list is too long"),
        ("l = make_list(5000, 0)\nm = l\ni = 0\nwhile True:\n l[i] = m\n i = i + 1\n end", "the list is too long"),
        ("l = make_list(100, 0)\ns = struct(a=l, b=0)\nwhile True:\n s.b = s\n sync()\n end", "the list is too long"),
        ("l = []\nwhile True:\n l.append(make_list(999, 0))\n sync()\n end", "the list is too long"),
        ('s = "0123456789abcdef"\nl = []\nwhile True:\n s = s + s\n sync()\n end', "the string is too long"),
    ],
)
def test_nothing_grows_without_limit(body, says):
    assert says in error_of(program(body))[0]


S64K = 's = "0123456789abcdef"\ni = 0\nwhile i < 12:\n s = s + s\n i = i + 1\n end\n'


@pytest.mark.parametrize(
    "statement",
    [
        "x = s + s",
        "textmsg(struct(a=s, b=1))",
        "textmsg([s, s])",
        "popup([s, s])",
    ],
)
def test_no_way_to_a_string_leads_past_its_limit(statement):
    assert "the string is too long, expected at most 65536 characters" in error_of(program(S64K + statement))[0]


def test_a_list_of_long_strings_is_limited_too():
    assert "at most 10000 elements" in error_of(program(f"{S64K}x = make_list(2000, s)"))[0]
    assert "the list is too long" in error_of(program(f"{S64K}l = []\nwhile True:\n l.append(s)\n sync()\n end"))[0]


def test_a_message_shows_the_beginning_of_a_long_value():
    message, _ = error_of(program("l = make_list(4000, [1])\nx = sin(l)"))
    assert "got the list [[1], [1], [1]" in message
    assert len(message) < 100


def test_too_much_time_is_told_with_a_line_where_no_statement_was_begun():
    run = ScriptRun("def prog():\n\n" + "x = 1\n" * 100 + "end", slice_budget=200).step()
    assert "too much time" in run.interpreter.error.message
    assert run.interpreter.error.line == 3
