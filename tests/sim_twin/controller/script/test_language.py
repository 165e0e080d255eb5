import pytest

from sim_twin.controller.pose import Pose
from sim_twin.controller.script import Status
from tests.support.scripts import ScriptRun, notes_of, program, value_of


def test_if_takes_the_first_branch_that_holds():
    body = """
    def kind(n):
        if n < 0:
            return "negative"
        elif n == 0:
            return "zero"
        elif n < 10:
            return "small"
        else:
            return "big"
        end
    end
    note(kind(-1))
    note(kind(0))
    note(kind(3))
    note(kind(30))
    """
    assert notes_of(body) == ["negative", "zero", "small", "big"]


def test_an_if_without_else_may_do_nothing():
    assert notes_of("if False:\n note(1)\n end\n note(2)") == [2]


def test_while_breaks_and_continues():
    body = """
    i = 0
    while True:
        i = i + 1
        if i == 2:
            continue
        end
        if i > 4:
            break
        end
        note(i)
    end
    note("after")
    """
    assert notes_of(body) == [1, 3, 4, "after"]


def test_break_leaves_the_inner_loop_only():
    body = """
    i = 0
    while i < 2:
        while True:
            break
        end
        i = i + 1
        note(i)
    end
    """
    assert notes_of(body) == [1, 2]


def test_return_leaves_loops_and_blocks():
    body = """
    def first_over(limit):
        i = 0
        while True:
            i = i + 3
            if i > limit:
                return i
            end
        end
    end
    note(first_over(7))
    """
    assert notes_of(body) == [9]


def test_a_function_without_return_gives_nothing():
    assert notes_of("def f():\n x = 1\n end\n note(f())\n def g():\n return\n end\n note(g())") == [None, None]


def test_arguments_go_by_place_by_name_and_by_default():
    body = """
    def f(a, b=2, c=a * 10):
        note(a, b, c)
    end
    f(1)
    f(1, 5)
    f(1, c=7)
    f(c=3, a=1, b=2)
    """
    assert notes_of(body) == [(1, 2, 10), (1, 5, 10), (1, 2, 7), (1, 2, 3)]


def test_builtins_take_arguments_by_name():
    def servo(q, t=0.1, gain=300):
        return [q, t, gain]

    assert notes_of("note(servo(1, gain=2))", servo=servo) == [[1, 0.1, 2]]


def test_functions_may_recurse_and_be_defined_after_their_use():
    body = """
    note(factorial(5))
    def factorial(n):
        if n < 2:
            return 1
        end
        return n * factorial(n - 1)
    end
    """
    assert notes_of(body) == [120]


def test_functions_nest_and_the_nearest_of_a_name_is_called():
    body = """
    def name():
        return "outer"
    end
    def f():
        def name():
            return "inner"
        end
        return name()
    end
    note(f())
    note(name())
    """
    assert notes_of(body) == ["inner", "outer"]


def test_a_long_chain_of_functions_compiles():
    links = "\n".join(f"def f{i}():\n return {f'f{i + 1}()' if i % 40 != 39 else i}\nend" for i in range(400))
    assert notes_of(f"{links}\nnote(f0())\nnote(f360())") == [39, 399]


def test_and_and_or_stop_where_the_answer_is_known():
    body = """
    def said(value):
        note(value)
        return value
    end
    note(said(False) and said(True))
    note(said(True) or said(False))
    """
    assert notes_of(body) == [False, False, True, True]


def test_lists_are_values_not_references():
    body = """
    a = [1, [2, 3]]
    b = a
    b[0] = 9
    b[1][0] = 8
    note(a)
    note(b)
    def change(values):
        values[0] = 7
        return values
    end
    note(change(a))
    note(a)
    """
    assert notes_of(body) == [[1, [2, 3]], [9, [8, 3]], [7, [2, 3]], [1, [2, 3]]]


def test_what_a_builtin_keeps_does_not_change_with_the_script():
    kept = []

    def keep(values):
        kept.append(values)

    notes_of("a = [1, 2]\nkeep(a)\na[0] = 5\nkeep(a)", keep=keep)
    assert kept == [[1, 2], [5, 2]]


def test_the_elements_of_a_pose_are_assigned_one_by_one():
    body = """
    x = p[1, 2, 3, 0, 0, 0]
    y = x
    y[0] = y[0] * 10
    note(x)
    note(y)
    z = [x, y]
    z[1][2] = 30
    note(z[1])
    """
    first, second, third = notes_of(body)
    assert first == Pose(1, 2, 3, 0, 0, 0)
    assert second == Pose(10, 2, 3, 0, 0, 0)
    assert third == Pose(10, 2, 30, 0, 0, 0)
    assert type(second) is Pose


def test_p_with_one_index_is_a_variable_and_with_six_numbers_a_pose():
    assert notes_of("p = [4, 5]\nnote(p[1])\nnote(p[1, 2, 3, 4, 5, 6])") == [5, Pose(1, 2, 3, 4, 5, 6)]


def test_a_matrix_has_two_indexes():
    assert notes_of("m = [[1, 2], [3, 4]]\nm[1, 0] = 9\nnote(m[1, 0])\nnote(m[1][1])\nnote(m)") == [
        9,
        4,
        [[1, 2], [9, 4]],
    ]


def test_structs_have_members():
    body = """
    s = struct(a=1, b=[1, 2])
    t = s
    t.a = 5
    t.b[0] = 7
    note(s.a, s.b)
    note(t.a, t.b)
    note(s == t)
    """
    assert notes_of(body) == [(1, [1, 2]), (5, [7, 2]), False]


def test_lists_grow_by_their_methods():
    body = """
    a = []
    a.append(1)
    a.extend([2, 3])
    a.insert(0, 0)
    a.remove(1)
    note(a)
    note(a.length())
    note(a.slice(1, 3))
    a.pop()
    note(a)
    a.clear()
    note(a)
    """
    assert notes_of(body) == [[0, 2, 3], 3, [2, 3], [0, 2], []]


@pytest.mark.parametrize("name", ["async", "time", "type", "p", "q", "for", "thread_move", "ending", "structure"])
def test_what_looks_like_a_keyword_may_be_a_name(name):
    assert notes_of(f"{name} = 3\nnote({name} + 1)") == [4]


def test_statements_are_made_of_tokens_not_of_lines():
    body = """
    x = # the value comes later

        3
    y = [1,
         2,   # two
         3]
    note(x, y,
         max=
         4
    )
    z = x +
        x
    if (x == 3 and
        z == 6): note("both") end
    """
    notes = []

    def note(*values, **named):
        notes.append((*values, *named.values()))

    notes_of(body, note=note)
    assert notes == [(3, [1, 2, 3], 4), ("both",)]


def test_labels_and_semicolons_are_let_pass():
    assert notes_of('$ 1 "Robot Program"\n note(1); note(2)\n $ 2 "MoveJ"\n note(3)') == [1, 2, 3]


def test_halt_ends_the_program_wherever_it_stands():
    run = ScriptRun(program("def f():\n halt\n end\n note(1)\n f()\n note(2)")).finish()
    assert run.interpreter.status is Status.FINISHED
    assert run.notes == [1]


def test_bare_statements_are_a_program_without_a_name():
    run = ScriptRun("note(1)\nnote(2)\n").finish()
    assert run.notes == [1, 2]


def test_variables_of_the_host_are_global():
    run = ScriptRun(program("def f():\n speed = speed + 1\n end\n f()\n note(speed)"), variables={"speed": 4}).finish()
    assert run.notes == [5]


def test_strings_keep_what_they_hold():
    assert value_of('"# no comment, it\'s text"') == "# no comment, it's text"


class TestScope:
    """The scoping rules of the manual, example by example."""

    def test_a_local_masks_the_global_of_its_name(self):
        assert notes_of("global a = 0\ndef f():\n local a = 1\n note(a)\nend\nf()\nnote(a)") == [1, 0]

    def test_a_free_name_is_the_global_one(self):
        assert notes_of("global a = 0\ndef f():\n a = 1\nend\nf()\nnote(a)") == [1]

    def test_the_first_level_is_global_whatever_it_says(self):
        assert notes_of("a = 0\nlocal b = 0\ndef f():\n a = 1\n b = 2\nend\nf()\nnote(a, b)") == [(1, 2)]

    def test_a_nested_function_sees_globals_not_its_parents_locals(self):
        body = "global a = 0\ndef f():\n local a = 1\n def g():\n  a = 2\n end\n g()\n note(a)\nend\nf()\nnote(a)"
        assert notes_of(body) == [1, 2]

    def test_global_inside_a_function_reaches_the_others(self):
        assert notes_of("def f():\n global a = 3\nend\ndef g():\n note(a)\nend\nf()\ng()") == [3]

    def test_a_name_assigned_before_its_global_exists_is_local(self):
        assert notes_of("def f():\n a = 1\n note(a)\nend\nf()\na = 5\nnote(a)\nf()\nnote(a)") == [1, 5, 1, 1]

    def test_locals_of_two_calls_are_two(self):
        body = "def f(n):\n x = n\n if n > 0:\n  f(n - 1)\n end\n note(x)\nend\nf(2)"
        assert notes_of(body) == [0, 1, 2]

    def test_a_parameter_masks_a_global(self):
        assert notes_of("a = 0\ndef f(a):\n a = a + 1\n note(a)\nend\nf(5)\nnote(a)") == [6, 0]
