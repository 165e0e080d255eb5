"""What a program does follows from its tokens, not from its names, the order of its functions or its layout."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_twin.controller.script.lexer import tokens_of
from tests.support.scripts import ScriptRun, program

HEAD = "global target = 0\nglobal worker = 0\nglobal total = [0, 0]"
FUNCTIONS = [
    """
    def scaled(value, factor=2):
        local result = value * factor
        return result
    end
    """,
    """
    thread follow():
        while True:
            enter_critical
            goal = target
            exit_critical
            move(goal, scaled(1))
        end
    end
    """,
    """
    def add(index, amount):
        total[index] = total[index] + amount
        if amount > 3:
            note(total, "large")
        elif amount == 3:
            note(total)
        end
    end
    """,
    """
    def restart(goal):
        if worker != 0:
            kill worker
        end
        target = goal
        worker = run follow()
    end
    """,
]
MAIN = """
    step = 0
    while step < 6:
        add(step % 2, amount=step)
        if step == 1 or step == 4:
            restart(step)
        end
        sleep(0.004)
        step = step + 1
    end
    kill worker
    note(scaled(step, 10), p[step, 0, 0, 0, 0, 0])
"""
OWN = ["target", "worker", "total", "scaled", "follow", "add", "restart", "step", "goal", "value", "result", "index"]


def trace(text):
    run = ScriptRun(text).finish()
    assert run.interpreter.error is None
    return run.by_slice


ORIGINAL = program("\n".join([HEAD, *FUNCTIONS, MAIN]))
EXPECTED = trace(ORIGINAL)


def test_the_original_does_something():
    assert len(EXPECTED) > 10
    assert EXPECTED[-1][1] == (60, (6.0, 0.0, 0.0, 0.0, 0.0, 0.0))


@given(st.permutations(FUNCTIONS))
def test_the_order_of_functions_does_not_matter(functions):
    assert trace(program("\n".join([HEAD, *functions, MAIN]))) == EXPECTED


@given(st.permutations(OWN), st.sampled_from(["x_", "the", "async", "end_", "If"]))
def test_names_do_not_matter(order, prefix):
    text = ORIGINAL
    for i, name in enumerate(order):
        text = re.sub(rf"\b{name}\b", f"{prefix}{i}", text)
    assert trace(text) == EXPECTED


@given(st.lists(st.sampled_from([" ", "   ", "\t", " # a comment\n", "\n", "\n\n  "]), min_size=3, max_size=20))
def test_layout_does_not_matter_inside_a_statement(gaps):
    """Any blank may stand between two tokens where neither ends a statement nor opens a call or an index."""
    pieces = []
    for i, token in enumerate(tokens_of(ORIGINAL)[:-1]):
        may_break = pieces and pieces[-1].strip() in ("=", "+", "*", ",", "(", "==", "or", ">", "!=", "<", "%", "[")
        gap = "\n" if token.is_first else gaps[i % len(gaps)] if may_break else " "
        if token.text in ("(", "[", "."):
            gap = gap if may_break else ""
        pieces.append(gap + token.text)
    assert trace("".join(pieces).lstrip()) == EXPECTED


@pytest.mark.parametrize("change", [lambda t: t.replace("\n", "\r\n"), lambda t: re.sub(r"(?m)^ +", "\t", t)])
def test_line_ends_and_indents_do_not_matter(change):
    assert trace(change(ORIGINAL)) == EXPECTED
