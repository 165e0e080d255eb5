"""Functions of numbers run as machine code and answer as Python does."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from config.loader import load_arm
from robot.chain import ToolChain, chain_points
from robot.compiled import Table, compiled
from robot.downward import DownwardArm
from robot.geometry import between, inside_box, unwound
from robot.messages import Vec3, Vec6
from robot.safety.sweep import Sweep

ARM = load_arm("ur5e")
JOINTS = st.tuples(*[st.floats(-3.1, 3.1)] * 6)
IS_COMPILED = os.environ.get("NUMBA_DISABLE_JIT", "0") == "0"


@pytest.mark.skipif(not IS_COMPILED, reason="NUMBA_DISABLE_JIT is set: everything runs as Python")
@given(JOINTS)
def test_machine_code_answers_as_python_does_to_the_last_digits(q):
    chain = ToolChain(ARM)
    found, by_python = chain.points(q), chain_points.py_func(q, chain.rows, chain.tcp_m, chain.elbow_m)
    assert np.allclose(np.ravel(found[0]), np.ravel(by_python[0]), rtol=0.0, atol=1e-14)
    assert found[1] == pytest.approx(by_python[1], abs=1e-14)
    assert between(q, ARM.home_rad, 0.3) == between.py_func(q, ARM.home_rad, 0.3)
    assert unwound(9.0 * q[0], q[1]) == unwound.py_func(9.0 * q[0], q[1])


def test_whole_numbers_are_taken_for_floats_and_another_number_of_joints_for_none():
    assert between((0, 0, 0, 0, 0, 0), (2, 2, 2, 2, 2, 2), 0.5) == (1.0,) * 6
    with pytest.raises((TypeError, ValueError, IndexError), match=r"matching|unpack|range"):
        between((0.0,) * 5, (0.0,) * 5, 0.5)


def test_what_cannot_be_compiled_is_told_where_it_is_written():
    def of_text(x: str) -> float:
        return float(x)

    def of_any_length(x: tuple[float, ...]) -> float:
        return x[0]

    for function in (of_text, of_any_length):
        with pytest.raises(TypeError, match="expected numbers, tables and tuples"):
            compiled(function)


def test_tables_truths_and_tuples_of_tuples_go_in_and_come_out():
    @compiled
    def described(table: Table, at: tuple[Vec3, Vec6], i: int) -> tuple[Vec3, bool]:
        return at[0], table[i, 0] > at[1][0]

    assert described(np.array([[1.0], [3.0]]), ((1.0, 2.0, 3.0), (2.0,) * 6), 1) == ((1.0, 2.0, 3.0), True)


def test_what_is_not_a_number_is_nowhere_and_has_no_joints():
    nan, down = math.nan, DownwardArm(ARM)
    assert not inside_box((nan, 0.0, 0.0), (-1.0,) * 3, (1.0,) * 3)
    for place in ((nan, 0.0, 0.2), (0.4, nan, 0.2), (0.4, 0.0, nan)):
        assert down.solve(place, 0.0, ARM.home_rad) is None
        assert down.near(place, 0.0, ARM.home_rad) is None
    assert math.isnan(Sweep(ARM).bound_m((nan, 0.0, 0.0, 0.0, 0.0, 0.0)))


def test_without_a_compiler_the_same_program_runs():
    code = (
        "from config.loader import load_arm; from robot.chain import ToolChain; a = load_arm('ur5e'); "
        "print(*ToolChain(a).tcp(a.home_rad))"
    )
    told = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, "NUMBA_DISABLE_JIT": "1"}, capture_output=True, check=True
    )
    assert [float(x) for x in told.stdout.split()] == pytest.approx(ToolChain(ARM).tcp(ARM.home_rad), abs=1e-12)


def test_machine_code_is_kept_nowhere_where_nothing_may_be_written(monkeypatch):
    import robot.compiled as module

    asked = []

    def njit(signature, cache=False):
        asked.append(cache)
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return lambda function: function

    monkeypatch.setattr(module.numba, "njit", njit)

    def half(x: float) -> float:
        return x / 2.0

    assert compiled(half)(3.0) == 1.5
    assert asked == [True, False]
