import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_twin.controller.pose import Pose
from sim_twin.controller.script.arithmetic import BINARY, UNARY, int32
from sim_twin.controller.script.errors import ScriptRuntimeError
from sim_twin.controller.script.values import ScriptStruct, copied, item, stored, text_of, truth
from tests.support.scripts import value_of

P = Pose(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)

numbers = st.one_of(st.integers(-(2**31), 2**31 - 1), st.floats(allow_nan=False))
values = st.recursive(
    st.one_of(st.none(), st.booleans(), numbers, st.text(max_size=3), st.just(P)),
    lambda inner: st.lists(inner, max_size=3),
    max_leaves=6,
)


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("1 + 2", 3),
        ("7 / 2", 3.5),
        ("6 / 2", 3.0),
        ("7 % 3", 1),
        ("-7 % 3", -1),
        ("7.5 % 2", 1.5),
        ("2 + 3 * 4", 14),
        ("(2 + 3) * 4", 20),
        ("2 - 3 - 4", -5),
        ("16 / 4 / 2", 2.0),
        ("3 * 7 % 5", 1),
        ("-2 * -3", 6),
        ("- (1 + 2)", -3),
        ("+4", 4),
        ("0xFF", 255),
        ("1e3", 1000.0),
        (".5", 0.5),
        ("2147483647 + 1", -2147483648),
        ("4294967296", 4294967296.0),
        ('"a" + "b"', "ab"),
        ("[1, 2, 3] + [10, 20, 30]", [11, 22, 33]),
        ("[10, 20, 30] / [1, 2, 3]", [10.0, 10.0, 10.0]),
        ("[10, 20, 30] % [3, 6, 7]", [1, 2, 2]),
        ("[1, 2, 3] * 5", [5, 10, 15]),
        ("-3 * [1, 2]", [-3, -6]),
        ("-[1, 2]", [-1, -2]),
        ("10 / [10, 20]", [1.0, 0.5]),
        ("5 * [[1, 2], [3, 4]]", [[5, 10], [15, 20]]),
        ("[[1, 2], [3, 4], [5, 6]] * [[10, 20, 30], [40, 50, 60]]", [[90, 120, 150], [190, 260, 330], [290, 400, 510]]),
        ("[[1, 2], [3, 4], [5, 6]] * [10, 20]", [50, 110, 170]),
        ("1 == 1.0", True),
        ("[1, 2] == [1, 2]", True),
        ("[1, 2] != [1, 3]", True),
        ('"a" == "a"', True),
        ("p[1,2,3,4,5,6] == [1,2,3,4,5,6]", False),
        ("1 < 2 and 2 <= 2 and 3 > 2 and 3 >= 3", True),
        ("not 1 == 2", True),
        ("not True or True", True),
        ("True xor True xor True", True),
        ("True xor True", False),
        ("False or True and False", False),
        ("1 + 1 == 2", True),
    ],
)
def test_expressions_by_hand(expression, expected):
    result = value_of(expression)
    assert result == expected
    assert type(result) is type(expected)


@pytest.mark.parametrize(
    ("symbol", "a", "b", "says"),
    [
        ("/", 1, 0, "division by zero"),
        ("%", 1.0, 0.0, "division by zero"),
        ("+", "a", 1, "str_cat"),
        ("+", True, 1, "the bool True"),
        ("+", None, 1, "nothing"),
        ("*", P, 2, "pose_trans"),
        ("+", [1], [1, 2], "equal lengths, got 1 and 2"),
        ("*", [[1, 2]], [1], "columns on the left"),
        ("<", "a", "b", "expected numbers around <"),
        ("<", True, 2, "expected numbers around <"),
    ],
)
def test_what_has_no_meaning_is_refused_by_name(symbol, a, b, says):
    with pytest.raises(ScriptRuntimeError, match=says):
        BINARY[symbol](a, b)


@given(st.sampled_from(sorted(BINARY)), values, values)
def test_an_operator_gives_a_value_or_a_runtime_error(symbol, a, b):
    try:
        result = BINARY[symbol](a, b)
    except ScriptRuntimeError:
        return
    text_of(result)


@given(st.sampled_from(sorted(UNARY)), values)
def test_a_prefix_gives_a_value_or_a_runtime_error(symbol, a):
    try:
        text_of(UNARY[symbol](a))
    except ScriptRuntimeError:
        return


@given(st.integers(-(2**31), 2**31 - 1), st.integers(-(2**31), 2**31 - 1))
def test_integers_stay_in_32_bits(a, b):
    for symbol in "+-*":
        result = BINARY[symbol](a, b)
        assert -(2**31) <= result < 2**31
        assert (result - {"+": a + b, "-": a - b, "*": a * b}[symbol]) % 2**32 == 0


@given(st.integers(-(2**31), 2**31 - 1), st.integers(1, 2**31 - 1))
def test_quotient_and_remainder_rebuild_the_number(a, b):
    rest = BINARY["%"](a, b)
    assert abs(rest) < b
    assert (a - rest) % b == 0
    assert rest == 0 or (rest > 0) == (a > 0)


@pytest.mark.parametrize(("given_", "wrapped"), [(2**31 - 1, 2**31 - 1), (2**31, -(2**31)), (-(2**31) - 1, 2**31 - 1)])
def test_int32_wraps_at_its_bounds(given_, wrapped):
    assert int32(given_) == wrapped


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (10, "10"),
        (2.123456123456, "2.12346"),
        (2.0, "2"),
        (True, "True"),
        ("as it is", "as it is"),
        ([1, [2.5, False]], "[1, [2.5, False]]"),
        (P, "p[1, 2, 3, 4, 5, 6]"),
        (ScriptStruct({"a": 1}), "struct(a=1)"),
        (None, "None"),
        (math.nan, "nan"),
    ],
)
def test_values_print_as_on_a_robot(value, text):
    assert text_of(value) == text


@pytest.mark.parametrize(
    ("value", "holds"), [(True, True), (False, False), (0, False), (2, True), (0.0, False), ("a", True), ("", False)]
)
def test_conditions_are_bools_numbers_and_strings(value, holds):
    assert truth(value) is holds


@pytest.mark.parametrize("value", [["a"], [], P, None])
def test_other_conditions_are_refused(value):
    with pytest.raises(ScriptRuntimeError, match="expected True or False"):
        truth(value)


@pytest.mark.parametrize(("index", "is_fine"), [(0, True), (2, True), (3, False), (-1, False), (1.0, True)])
def test_an_index_is_from_zero_to_the_last(index, is_fine):
    if is_fine:
        assert item([4, 5, 6], index) == [4, 5, 6][int(index)]
        assert stored([4, 5, 6], index, 9)[int(index)] == 9
        return
    for call in (lambda: item([4, 5, 6], index), lambda: stored([4, 5, 6], index, 9)):
        with pytest.raises(ScriptRuntimeError, match=f"index {index} is out of range, expected 0 to 2"):
            call()


def test_a_pose_takes_numbers_only_and_stays_a_pose():
    assert stored(P, 2, 9) == Pose(1.0, 2.0, 9.0, 4.0, 5.0, 6.0)
    with pytest.raises(ScriptRuntimeError, match="expected a number as element of a pose"):
        stored(P, 2, "9")


@given(values)
def test_a_copy_is_equal_and_shares_no_list(value):
    again = copied(value)
    assert again == value
    if isinstance(value, list):
        again.append(1)
        assert len(value) == len(again) - 1
