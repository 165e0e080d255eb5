import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_twin.controller.pose import Pose
from sim_twin.controller.script.builtins import PURE, slices_in
from tests.support.scripts import error_of, program, value_of


@pytest.mark.parametrize(
    ("call", "expected"),
    [
        ("sin(0.5)", math.sin(0.5)),
        ("cos(0.5)", math.cos(0.5)),
        ("tan(0.5)", math.tan(0.5)),
        ("asin(0.5)", math.asin(0.5)),
        ("acos(0.5)", math.acos(0.5)),
        ("atan(0.5)", math.atan(0.5)),
        ("atan2(1, 2)", math.atan2(1, 2)),
        ("sqrt(9)", 3.0),
        ("pow(2, 10)", 1024),
        ("pow(2, 0.5)", math.sqrt(2)),
        ("pow(2, -1)", 0.5),
        ("log(2, 8)", 3.0),
        ("floor(2.7)", 2),
        ("floor(-2.1)", -3),
        ("ceil(2.1)", 3),
        ("d2r(180)", math.pi),
        ("r2d(d2r(30))", 30.0),
        ("norm([3, 4])", 5.0),
        ("norm(-2.5)", 2.5),
        ("norm(-2)", 2),
        ("transpose([[1, 2, 3], [4, 5, 6]])", [[1, 4], [2, 5], [3, 6]]),
        ("inv([[2, 0], [0, 4]])", [[0.5, 0.0], [0.0, 0.25]]),
        ("inv(p[1, 2, 3, 0, 0, 0])", Pose(-1, -2, -3, 0, 0, 0)),
        ("size([[1, 2, 3], [4, 5, 6]])", [2, 3]),
        ("size([1, 2, 3])", 3),
        ("length([1, 2, 3])", 3),
        ('length("abcd")', 4),
        ("get_list_length([])", 0),
        ("make_list(3, 0)", [0, 0, 0]),
        ("make_list(2, [1], 5)", [[1], [1]]),
        ("list_append([1], 2)", [1, 2]),
        ("binary_list_to_integer([True, False, True])", 5),
        ("binary_list_to_integer(integer_to_binary_list(-7))", -7),
        ('to_num("410")', 410),
        ('to_num("3.25")', 3.25),
        ('to_num(" -1.0e2")', -100.0),
        ("to_str(2.123456123456)", "2.123456"),
        ("to_str([True, False])", "[True, False]"),
        ('str_cat("a", 2.5)', "a2.5"),
        ('str_cat("at ", str_cat([1, 2], p[1, 2, 3, 4, 5, 6]))', "at [1, 2]p[1, 2, 3, 4, 5, 6]"),
        ('str_at("Hello", 1)', "e"),
        ('str_empty("")', True),
        ('str_empty("a")', False),
        ('str_find("hello", "l")', 2),
        ('str_find("hello", "l", 3)', 3),
        ('str_find("hello", "x")', -1),
        ('str_len("hello")', 5),
        ('str_sub("0123456789", 3)', "3456789"),
        ('str_sub("0123456789", 3, 2)', "34"),
        ("point_dist(p[0,0,0,1,2,3], p[3,4,0,0,0,0])", 5.0),
        ("get_steptime()", 0.002),
    ],
)
def test_builtins_by_hand(call, expected):
    result = value_of(call)
    assert result == (pytest.approx(expected) if isinstance(expected, float) else expected)
    assert type(result) is type(expected)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        ("pose_trans([1, 2, 3, 4, 5, 6], p[1, 2, 3, 4, 5, 6])", "pose_trans(): expected a pose, got the list"),
        ("pow(0, -1)", "pow(): expected numbers that have a power, got the integer 0, the integer -1"),
        ("inv([[1, 1], [1, 1]])", "inv(): expected a matrix that can be inverted"),
        ("transpose([[1], [1, 2]])", "transpose(): expected a matrix"),
        ("norm(True)", "norm(): expected a list, got the bool True"),
        ("norm([True])", "norm(): expected a number, got the bool True"),
        ("make_list(-1, 0)", "make_list(): expected a length of 0"),
        ("make_list(3, 0, 2)", "make_list(): expected a length of 0 up to the capacity"),
        ("binary_list_to_integer([1])", "expected True or False, got the integer 1"),
        ('to_num("three")', "to_num(): "),
        ('str_at("abc", 3)', "str_at(): expected an index from 0 and below 3, got 3"),
        ('str_sub("abc", 4)', "str_sub(): expected an index from 0 to 3, got 4"),
        ("rotvec2rpy([1, 2])", "rotvec2rpy(): expected 3 finite numbers, got the list [1, 2]"),
        ("length(3)", "length(): expected a list or a string"),
        ("sleep(pow(10, 400))", "pow(): expected numbers that have a power"),
        ('popup("a", blocking=1)', "popup(): expected True or False"),
    ],
)
def test_a_wrong_argument_ends_the_program_with_the_builtins_name(call, says):
    message, line = error_of(program(call))
    assert says in message
    assert line == 2


def test_the_pose_functions_are_those_of_the_pose_file():
    turned = value_of("pose_trans(p[1, 0, 0, 0, 0, d2r(90)], p[2, 0, 0, 0, 0, 0])")
    assert turned == pytest.approx((1, 2, 0, 0, 0, math.pi / 2))
    assert value_of("pose_inv(p[1, 2, 3, 0, 0, 0])") == Pose(-1, -2, -3, 0, 0, 0)
    assert value_of("pose_add(p[1, 2, 3, 0, 0, 0], p[1, 1, 1, 0, 0, 0])") == Pose(2, 3, 4, 0, 0, 0)
    assert value_of("pose_sub(p[1, 2, 3, 0, 0, 0], p[1, 1, 1, 0, 0, 0])") == Pose(0, 1, 2, 0, 0, 0)
    assert value_of("interpolate_pose(p[0, 0, 0, 0, 0, 0], p[1, 2, 4, 0, 0, 0], 0.5)") == Pose(0.5, 1, 2, 0, 0, 0)
    assert value_of("rotvec2rpy(rpy2rotvec([0.1, 0.2, 0.3]))") == pytest.approx([0.1, 0.2, 0.3])
    assert value_of("wrench_trans(p[1, 0, 0, 0, 0, 0], [0, 0, 10, 0, 0, 0])") == pytest.approx([0, 0, 10, 0, 10, 0])
    assert value_of("pose_dist(p[0, 0, 0, 0, 0, 0], p[0, 3, 4, 0, 0, 0])") == pytest.approx(5)


@given(st.integers(-(2**31), 2**31 - 1))
def test_an_integer_to_bits_and_back_is_the_same(number):
    bits = PURE["integer_to_binary_list"](number)
    assert len(bits) == 32
    assert PURE["binary_list_to_integer"](bits) == number


@pytest.mark.parametrize(
    ("duration_s", "n"), [(0, 0), (-1, 0), (0.001, 1), (0.002, 1), (0.0021, 2), (0.1, 50), (1.1, 550), (2.0, 1000)]
)
def test_a_duration_is_so_many_slices(duration_s, n):
    assert slices_in(duration_s, 0.002) == n
