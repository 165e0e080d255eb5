"""The servo bench on a controller of its own: every row is there and means what it says, however busy the machine."""

import re

import numpy as np
import pytest

from sim_twin.servo_bench import bench_servo
from sim_twin.tally import Tally

pytestmark = pytest.mark.realtime

AGREED = (
    "period_p50_ms", "period_p99_ms", "bare_period_p99_ms", "own_work_p99_us", "controller_tick_p99_ms",
    "late_tick_share",
)  # fmt: skip
MEMORY = [f"{who}_rss_{what}" for who in ("client", "controller") for what in ("start_mb", "end_mb", "mb_per_h")]


@pytest.fixture(scope="module")
def report():
    return bench_servo(full=False, seconds=1.0)


@pytest.fixture(scope="module")
def rows(report):
    return {row.name: row for row in report.results}


def test_every_row_is_there_once_and_finite(report, rows):
    assert report.bench == "servo"
    assert report.versions["ur_rtde"] != "not installed"
    assert len(rows) == len(report.results)
    assert {*AGREED, *MEMORY} <= set(rows)
    assert np.isfinite([row.value for row in report.results]).all()


def test_both_loops_tick_at_the_arms_period(rows):
    for name in ("period_p50_ms", "bare_period_p50_ms"):
        assert 1.9 < rows[name].value < 4.0
    assert rows["period_p99_ms"].value >= rows["period_p50_ms"].value
    assert 20 < rows["ticks"].value <= 600
    assert 0.0 <= rows["late_tick_share"].value < 1.0


def test_our_work_is_more_than_nothing_and_less_than_a_period(rows):
    assert 5.0 < rows["own_work_p50_us"].value < 1500.0
    assert rows["own_work_p99_us"].value >= rows["own_work_p50_us"].value
    assert 0.02 < rows["controller_tick_p50_ms"].value < 5.0


def test_memory_is_that_of_two_processes_that_hold_a_model_each(rows):
    for who in ("client", "controller"):
        assert 30.0 < rows[f"{who}_rss_start_mb"].value < 2000.0
        assert rows[f"{who}_rss_end_mb"].value == pytest.approx(rows[f"{who}_rss_start_mb"].value, rel=0.3)


def test_a_row_is_ok_when_it_meets_its_goal(rows):
    judged = [row for row in rows.values() if row.goal]
    assert {"own_work_p99_us", "late_tick_share", "controller_tick_p99_ms"} <= {row.name for row in judged}
    for row in judged:
        sign, limit = re.fullmatch(r"(<=|=) ([0-9.]+)", row.goal).groups()
        assert row.ok == (row.value <= float(limit) if sign == "<=" else row.value == float(limit))


def test_percentiles_of_a_tally_are_those_of_its_durations():
    durations_s = np.random.default_rng(0).gamma(2.0, 1e-3, 4000)
    tally = Tally(over_s=2e-3)
    for duration_s in durations_s:
        tally.add(duration_s)
    for percent in (1.0, 50.0, 99.0, 100.0):
        expected_s = np.percentile(durations_s, percent, method="inverted_cdf")
        assert tally.percentile_s(percent) == pytest.approx(expected_s, abs=1e-6)
    assert tally.over_share == np.mean(durations_s > 2e-3)


def test_a_tally_counts_what_is_too_long_at_its_limit_and_is_zero_when_empty():
    tally = Tally(limit_us=100)
    assert (tally.percentile_s(99.0), tally.over_share) == (0.0, 0.0)
    tally.add(1.0)
    assert tally.percentile_s(50.0) == pytest.approx(100e-6)
