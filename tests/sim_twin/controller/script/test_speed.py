"""Bounds that a slow machine keeps by a wide margin; the best of some runs is compared, since others may be at work."""

from time import process_time

import pytest

from sim_twin.controller.script import Interpreter, Status, parse_program
from sim_twin.controller.script.builtins import time_builtins

pytestmark = pytest.mark.realtime


def best_of(n, call):
    durations_s = []
    for _ in range(n):
        start = process_time()
        call()
        durations_s.append(process_time() - start)
    return min(durations_s)


def branch(i):
    return f"""
        elif command == {i}:
            # branch {i}
            values = [0, 0, 0, 0, 0, 0]
            values[0] = read(register + {i})
            values[1] = values[0] * 2.5 + offset
            pose = p[values[0], values[1], 0, 0, 0, 0]
            write(0, pose[0])
            write(1, {i})
    """


LONG = f"""
def long():
    global offset = 0
    def dispatch(command, register=0):
        if command == -1:
            write(0, -1)
        {"".join(branch(i) for i in range(170))}
        end
        return True
    end
    is_on = True
    while is_on:
        command = read(0)
        if {" or ".join(f"command == {i}" for i in range(100, 116))}:
            is_on = dispatch(command)
        else:
            is_on = dispatch(169)
        end
        sync()
    end
end
"""

WRITTEN = {}
BUILTINS = {"read": lambda i: i, "write": WRITTEN.__setitem__, **time_builtins(slice_s=0.002)}


def test_fifty_kilobytes_are_parsed_and_compiled_in_a_blink():
    assert len(LONG) > 50_000
    program = parse_program(LONG)
    assert best_of(5, lambda: parse_program(LONG)) < 0.25
    assert best_of(5, lambda: Interpreter(program, BUILTINS)) < 0.4


def test_twice_the_text_takes_about_twice_the_time():
    half = "def f():\n" + "x = [1, 2 + y, g(3)]\n" * 500 + "end"
    whole = "def f():\n" + "x = [1, 2 + y, g(3)]\n" * 2000 + "end"
    assert best_of(5, lambda: parse_program(whole)) < 10 * best_of(5, lambda: parse_program(half))


def test_a_slice_of_a_main_loop_is_a_small_part_of_a_period():
    interpreter = Interpreter(parse_program(LONG), BUILTINS)
    interpreter.step()
    # Through 186 comparisons each slice, the worst case of such a loop.
    assert best_of(300, interpreter.step) < 0.002
    assert interpreter.status is Status.RUNNING
    assert WRITTEN[1] == 169
