"""What UR's script manual (e-Series) says of functions that need no robot, case by case: *exact* is held to it."""

import inspect
import math
import re
from pathlib import Path

import pytest

from sim_twin.controller.pose import Pose
from sim_twin.controller.script.builtins import PURE
from tests.support.scripts import error_of, notes_of, program, value_of

TABLE = Path(__file__).parents[4] / "docs" / "virtual-controller-table.md"
BITS_57 = [True, False, False, True, True, True, *[False] * 26]
INVERTED = Pose(0.19324, 0.41794, -0.29662, 1.23993, 0.0, 2.47985)
EXACTLY = [
    ("binary_list_to_integer([True, False, False, True])", 9),
    ("binary_list_to_integer([])", 0),
    ("binary_list_to_integer(make_list(40, True))", -1),
    ("ceil(1.43)", 2),
    ("floor(1.53)", 1),
    ("get_list_length([1, 3, 3, 6, 2])", 5),
    ("integer_to_binary_list(57)", BITS_57),
    ("inv([[0, 1, 0], [0, 0, 1], [1, 0, 0]])", [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    ('length("here I am")', 9),
    ('length("é")', 1),
    ("log(10, 0)", -math.inf),
    ('make_list(5, "a")', ["a", "a", "a", "a", "a"]),
    ("make_list(10, 0, 100)", [0] * 10),
    ("make_list(0, 0, 100)", []),
    ("norm(-5.3)", 5.3),
    ("norm(-8)", 8),
    ("pow(5., 3)", 125.0),
    ('size("here I am")', 9),
    ("size([1, 2, 3, 4, 5])", 5),
    ("size([[1, 2], [3, 4], [5, 6]])", [3, 2]),
    ("sqrt(9)", 3.0),
    ("transpose([[1, 2], [3, 4], [5, 6]])", [[1, 3, 5], [2, 4, 6]]),
    ("transpose([1, 2, 3])", [[1], [2], [3]]),
    ("transpose([[1], [2], [3]])", [1, 2, 3]),
    ('str_at("Hello", 0)', "H"),
    ('str_at("Hello", 1)', "e"),
    ('str_cat("Hello", " World!")', "Hello World!"),
    ('str_cat("Integer ", 1)', "Integer 1"),
    ('str_cat("", p[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])', "p[1, 2, 3, 4, 5, 6]"),
    ("str_cat([True, False, True], [1, 0, 1])", "[True, False, True][1, 0, 1]"),
    ('str_cat(str_cat("", str_cat("One", "Two")), str_cat(3, 4))', "OneTwo34"),
    ('str_cat("", 0.0000123)', "0.000012"),
    ('str_empty("")', True),
    ('str_empty("Hello")', False),
    ('str_find("Hello World!", "o")', 4),
    ('str_find("Hello World!", "lo")', 3),
    ('str_find("Hello World!", "o", 5)', 7),
    ('str_find("abc", "z")', -1),
    ('str_find("éa", "a")', 2),
    ('str_len("Hello")', 5),
    ('str_len("")', 0),
    ('str_len("é")', 2),
    ('str_len(str_at("é", 0))', 1),
    ('str_cat(str_at("é", 0), str_at("é", 1)) == "é"', True),
    ('str_sub("0123456789abcdefghij", 5, 3)', "567"),
    ('str_sub("0123456789abcdefghij", 10)', "abcdefghij"),
    ('str_sub("0123456789abcdefghij", 2, 0)', ""),
    ('str_sub("abcde", 2, 50)', "cde"),
    ('str_sub("abcde", 5)', ""),
    ('to_num("10")', 10),
    ('to_num("3.14")', 3.14),
    ('to_num("-3.0e5")', -3.0e5),
    ('to_num("+5.")', 5.0),
    ('to_num(".36")', 0.36),
    ('to_num("10e3")', 10_000),
    ('to_num("2.5E-5")', 2.5e-5),
    ('to_num("-5e-4")', -5e-4),
    ('to_num("  -5")', -5),
    ('to_num("0x3A")', 0x3A),
    ('to_num("0Xb5")', 0xB5),
    ('to_num("-0x80000000")', -0x8000_0000),
    ('to_num("INF")', math.inf),
    ('to_num("-infinity")', -math.inf),
    ('to_str(to_num("NaN"))', "nan"),
    ("to_str(10)", "10"),
    ("to_str(2.123456123456)", "2.123456"),
    ("to_str(123456.789)", "123456.789"),
    ("to_str(0.0000001)", "0"),
    ("to_str(100.0)", "100"),
    ("to_str(p[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])", "p[1, 2, 3, 4, 5, 6]"),
    ("to_str([True, False, True])", "[True, False, True]"),
    ("to_str([p[1, 0, 0, 0, 0, 0], p[0, 0.5, 0, 0, 0, 0]])", "[p[1, 0, 0, 0, 0, 0], p[0, 0.5, 0, 0, 0, 0]]"),
]
"""What is returned, its type too."""
ROUNDED = [
    ("acos(0.707)", 0.785),
    ("asin(0.707)", 0.785),
    ("atan(1.)", 0.785),
    ("atan2(.5, .5)", 0.785),
    ("atan2(1, 0)", math.pi / 2),
    ("cos(1.57)", 0.0),
    ("d2r(90)", 1.5708),
    ("r2d(1.570796)", 90.0),
    ("sin(1.57)", 1.0),
    ("tan(.7854)", 1.0),
    ("log(10., 4.)", 0.60206),
    ("norm(p[-.2, .2, -.2, -1.57, 0, 3.14])", 3.52768),
    ("inv(p[.2, .5, .1, 1.57, 0, 3.14])", INVERTED),
    ("pose_inv(p[.2, .5, .1, 1.57, 0, 3.14])", INVERTED),
    ("interpolate_pose(p[.2, .2, .4, 0, 0, 0], p[.2, .2, .6, 0, 0, 0], .5)", Pose(0.2, 0.2, 0.5, 0, 0, 0)),
    ("interpolate_pose(p[.2, .2, .4, 0, 0, 0], p[.2, .2, .6, 0, 0, 0], -1)", Pose(0.2, 0.2, 0.2, 0, 0, 0)),
    ("point_dist(p[.2, .5, .1, 1.57, 0, 3.14], p[.2, .5, .6, 0, 1.57, 3.14])", 0.5),
    ("pose_add(p[.2, .5, .1, 1.57, 0, 0], p[.2, .5, .6, 1.57, 0, 0])", Pose(0.4, 1.0, 0.7, 3.14, 0, 0)),
    ("pose_dist(p[.2, .5, .1, 1.57, 0, 0], p[.2, .5, .6, 1.57, 0, 0])", 0.5),
    ("pose_sub(p[.2, .5, .1, 1.57, 0, 0], p[.2, .5, .6, 1.57, 0, 0])", Pose(0, 0, -0.5, 0, 0, 0)),
    ("pose_trans(p[.2, .5, .1, 1.57, 0, 0], p[.2, .5, .6, 1.57, 0, 0])", Pose(0.4, -0.0996, 0.60048, 3.14, 0, 0)),
    ("rotvec2rpy([3.14, 1.57, 0])", [-2.80856, -0.16202, 0.9]),
    ("rpy2rotvec([3.14, 1.57, 0])", [2.22153, 0.00177, -2.21976]),
    ("wrench_trans(p[0, 0, 0.1, 0, 0, 0], [10, 0, 0, 0, 0, 0])", [10.0, 0.0, 0.0, 0.0, -1.0, 0.0]),
]
"""What is returned, to the digits that the manual gives."""
ERRORS = [
    *["acos(1.1)", "asin(-1.1)", "sqrt(-1)", "log(1, 5)", "log(-2, 5)", "log(2, -5)", "pow(-2, 0.5)", "pow(0, -1)"],
    *["inv([[1, 1], [1, 1]])", "inv([[1, 2, 3], [4, 5, 6]])"],
    *['str_at("Hello", 10)', 'str_at("", 0)', 'str_sub("abcde", -5, 50)', 'str_sub("abcde", 2, -1)'],
    *['to_num("123abc")', 'to_num("1e400")', 'to_num("1.0e400")', 'to_num("10 ")', 'to_num("1_0")', 'to_num("")'],
    *['to_num("2147483648")', 'to_num("0x80000000")', 'to_num("0x")', 'to_num(".")', 'to_num("1 2")'],
    *['str_cat([[1, 2], [3, 4]], "")', 'str_cat(struct(a=1), "")', 'str_cat(["a"], "b")', "to_str([[1], [2]])"],
    *["to_str(make_list(400, 1))", "to_str(struct(a=1))"],
]
"""What ends the program."""
PARAMETERS = {
    "acos": "f", "asin": "f", "atan": "f", "atan2": "x y", "binary_list_to_integer": "l", "ceil": "f", "cos": "f",
    "d2r": "d", "floor": "f", "make_list": "length initial_value capacity", "get_list_length": "v",
    "integer_to_binary_list": "x", "interpolate_pose": "p_from p_to alpha", "inv": "m", "length": "v", "log": "b f",
    "norm": "a", "point_dist": "p_from p_to", "pose_add": "p_1 p_2", "pose_dist": "p_from p_to", "pose_inv": "p_from",
    "pose_sub": "p_to p_from", "pose_trans": "p_from p_from_to", "pow": "base exponent", "r2d": "r",
    "rotvec2rpy": "rotation_vector", "rpy2rotvec": "rpy_vector", "sin": "f", "size": "v", "sqrt": "f", "tan": "f",
    "transpose": "m", "wrench_trans": "T_from_to w_from", "str_at": "src index", "str_cat": "op1 op2",
    "str_empty": "str", "str_find": "src target start_from", "str_len": "str", "str_sub": "src index len",
    "to_num": "str", "to_str": "val",
}  # fmt: skip
"""By which names arguments can be given."""


def exact_functions():
    """Return the functions of the table that are told to be exact."""
    section = TABLE.read_text(encoding="utf-8").split("## URScript built-in functions")[1].split("\n## ")[0]
    rows = [line.strip("|").split("|") for line in section.splitlines() if line.startswith("|")]
    exact = [row[0] for row in rows if row[-1].strip().startswith("exact")]
    return {name for names in exact for name in re.findall(r"`([^`]+)`", names)}


@pytest.mark.parametrize(("expression", "expected"), EXACTLY)
def test_a_function_returns_what_the_manual_says(expression, expected):
    result = value_of(expression)
    assert result == expected
    assert type(result) is type(expected)


@pytest.mark.parametrize(("expression", "expected"), ROUNDED)
def test_a_function_returns_what_the_manual_rounds(expression, expected):
    result = value_of(expression)
    assert result == pytest.approx(expected, abs=2e-3)
    assert type(result) is type(expected)


@pytest.mark.parametrize("expression", ERRORS)
def test_a_function_raises_where_the_manual_says_so(expression):
    message, line = error_of(program(f"note({expression})"))
    assert f"{expression[: expression.index('(')]}(): " in message
    assert line == 2


@pytest.mark.parametrize(("n", "is_fine"), [(1023, True), (1024, False)])
def test_a_string_that_is_put_together_has_at_most_1023_bytes(n, is_fine):
    body = f's = ""\ni = 0\nwhile i < {n - 1}:\n s = s + "x"\n i = i + 1\n end\n'
    if is_fine:
        assert notes_of(f'{body}note(str_len(str_cat(s, "x")))\nnote(str_len(to_str(str_cat("x", s))))') == [n, n]
    else:
        assert "at most 1023 bytes" in error_of(program(f'{body}str_cat(s, "x")'))[0]


def test_arguments_have_the_manuals_names():
    told = {name: " ".join(inspect.signature(PURE[name]).parameters) for name in PARAMETERS}
    assert told == PARAMETERS


def test_every_exact_function_without_a_robot_is_held_to_the_manual_by_a_case():
    pure = exact_functions() & PURE.keys()
    held = {name for expression, _ in (*EXACTLY, *ROUNDED) for name in re.findall(r"(\w+)\(", expression)}
    assert len(pure) > 30
    assert pure - held == set()
    assert pure - PARAMETERS.keys() == set()


def test_what_a_message_shows_is_the_text_that_was_written():
    assert error_of(program('sin("é€")'))[0].endswith("got the string 'é€'")
