"""Whatever a builtin is handed: it works, or says in plain words what it expected. Nothing of Python shows."""

import inspect

import numpy as np
import pytest

from sim_twin.controller.builtins import program_builtins
from sim_twin.controller.script import Interpreter, Status, parse_program
from sim_twin.controller.script.builtins import Sockets
from sim_twin.controller.wire import ControllerVersion
from tests.support.virtual_robot import make_robot

N_DRAWS = 25
INFINITE = "(1e308*10)"
NOT_A_NUMBER = f"({INFINITE} - {INFINITE})"
GIVEN = [
    *["-1", "0", "1", "7.5", "99", "1e300", INFINITE, NOT_A_NUMBER, "True", '"foo"', '""', "struct(a=1)"],
    *["[]", "[1]", "[1, 2]", "[1, 2, 3]", "[1, 2, 3, 4, 5, 6]", "[True, 1, 2, 3, 4, 5]", '["a"]', "[[1], [2, 3]]"],
    *["p[1, 2, 3, 4, 5, 6]", "p[0.3, 0.2, 0.3, 0, 3, 0]", f"[{INFINITE}, 0, 0, 0, 0, 0]", f"[{NOT_A_NUMBER}, 0, 0]"],
]
OUR_WORDS = ("expected", " misses the argument", "inverse kinematics: ", "singular")


@pytest.fixture(scope="module")
def robot():
    return make_robot(version=ControllerVersion(minor=99))


def said(robot, builtins, text):
    """Run a statement for a slice and return why it failed, empty where it did not."""
    interpreter = Interpreter(parse_program(text), builtins)
    interpreter.step()
    interpreter.stop()
    robot.step()
    return interpreter.error.message if interpreter.status is Status.FAILED else ""


def test_no_argument_brings_out_anything_but_plain_words(robot):
    builtins = program_builtins(robot.machine, Sockets(slice_s=0.002))
    rng = np.random.default_rng(5)
    n_refused = 0
    for name in sorted(builtins.keys() - {"powerdown", "socket_open"}):
        n = len(inspect.signature(builtins[name]).parameters)
        for _ in range(N_DRAWS if n else 1):
            text = f"{name}({', '.join(rng.choice(GIVEN, rng.integers(0, n + 1)))})"
            why = said(robot, builtins, text)
            assert not why or (any(words in why for words in OUR_WORDS) and "expected other" not in why), (text, why)
            n_refused += bool(why)
    assert n_refused > 500


@pytest.mark.parametrize(
    ("statement", "words"),
    [
        ("movej([1, 2])", "movej(): expected 6 finite numbers, got the list [1, 2]"),
        ("movel([0, 0, 0, 0, 0, 0, 0])", "movel(): expected 6 finite numbers"),
        ("acos(2)", "acos(): expected a number from -1 to 1, got the integer 2"),
        (
            'rtde_set_watchdog("input_int_register_0", 10, "foo")',
            "expected one of the actions ignore, pause, stop",
        ),
        ('to_num("one")', "to_num(): expected a string that spells a number, got the string 'one'"),
        ("force_mode(p[0,0,0,0,0,0], [0,0,1,0,0,0], [0,0,0,0,0,0], 9, [1,1,1,1,1,1])", "a type from 1 to 3, got 9"),
        (f"set_payload(1, [{NOT_A_NUMBER}, 0, 0])", "set_payload(): expected 3 finite numbers"),
        (f"set_payload_cog([0, {NOT_A_NUMBER}, 0])", "set_payload_cog(): expected 3 finite numbers"),
        (f"set_payload({INFINITE})", "expected 0 to 100 kg"),
        ("set_tcp(p[0, 0, 1e300, 0, 0, 0])", "tool offset: expected within 10 m"),
        ("set_tcp(p[0, 0, 0, 0, 11, 0])", "tool offset: expected within 10 m and rad"),
        ("set_payload(1e300)", "expected 0 to 100 kg"),
        ("set_payload(1, [0, 1e300, 0])", "expected a centre of gravity within 10 m"),
        (f"set_gravity([0, 0, {NOT_A_NUMBER}])", "set_gravity(): expected 3 finite numbers"),
    ],
)
def test_what_was_expected_and_what_came_is_said(robot, statement, words):
    builtins = program_builtins(robot.machine, Sockets(slice_s=0.002))
    assert words in said(robot, builtins, statement)


def test_an_integer_of_any_size_is_sent_in_32_bits(robot):
    assert said(robot, program_builtins(robot.machine, Sockets(slice_s=0.002)), "socket_send_int(1e300)") == ""
