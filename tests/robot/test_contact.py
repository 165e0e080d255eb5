import pytest

from config.loader import load_arm
from robot.motion.contact import PROBE_M, ContactGuard

ARM = load_arm("ur5e")
LIMIT = ARM.motion.contact_force_n
TOOL = (0.4, 0.0, 0.1)
BELOW = (0.4, 0.0, 0.09)
FREE = (0.0, 0.0, 0.0)


@pytest.fixture
def guard():
    return ContactGuard(ARM)


def test_a_push_from_below_puts_the_target_on_the_tool_and_counts_as_contact(guard):
    assert guard.reseat((0.0, 0.0, LIMIT + 1.0), TOOL, TOOL, BELOW) == TOOL
    assert guard.is_in_contact


@pytest.mark.parametrize("force", [(0.0, 0.0, LIMIT), FREE, (0.0, 0.0, -2 * LIMIT)])
def test_no_more_than_the_limit_or_another_direction_changes_nothing(guard, force):
    assert guard.reseat(force, TOOL, TOOL, BELOW) is None
    assert not guard.is_in_contact


def test_a_push_while_the_target_is_above_changes_nothing(guard):
    assert guard.reseat((0.0, 0.0, 10 * LIMIT), TOOL, TOOL, (0.4, 0.0, 0.12)) is None


def test_a_command_that_runs_ahead_of_the_tool_falls_back_while_it_is_pushed(guard):
    assert guard.reseat((0.0, 0.0, LIMIT + 1.0), TOOL, BELOW, TOOL) == TOOL
    assert guard.reseat((0.0, 0.0, LIMIT + 1.0), TOOL, TOOL, TOOL) is None


def test_a_tool_that_was_told_to_rise_is_not_held_down_by_what_it_still_presses_on(guard):
    above = (0.4, 0.0, 0.12)
    assert guard.reseat((0.0, 0.0, LIMIT + 1.0), TOOL, BELOW, above) == above


@pytest.mark.parametrize(
    ("force_n", "commanded_z_m", "target_z_m", "is_led_up"),
    [
        (LIMIT + 1.0, 0.1, 0.12, True),
        (LIMIT, 0.1, 0.12, False),
        (LIMIT + 1.0, 0.0995, 0.12, True),
        (LIMIT + 1.0, 0.0985, 0.12, False),
        (LIMIT + 1.0, 0.1, 0.1005, False),
    ],
)
def test_a_tool_is_led_up_from_what_pushes_it_up_unless_its_command_is_lower(
    guard, force_n, commanded_z_m, target_z_m, is_led_up
):
    force = (-100.0, 40.0, force_n)
    assert guard.is_led_up(force, TOOL, (0.4, 0.0, commanded_z_m), (0.4, 0.0, target_z_m)) is is_led_up


def test_held_up_a_step_down_is_only_a_probe(guard):
    guard.reseat((0.0, 0.0, LIMIT + 1.0), TOOL, TOOL, BELOW)
    eased, is_eased = guard.ease(TOOL, (0.4, 0.0, 0.08))
    assert is_eased
    assert eased == pytest.approx((0.4, 0.0, TOOL[2] - PROBE_M))
    assert guard.is_in_contact


def test_contact_lasts_while_the_force_rests_between_probes(guard):
    guard.reseat((0.0, 0.0, LIMIT + 1.0), TOOL, TOOL, BELOW)
    for _ in range(10):
        assert guard.reseat(FREE, TOOL, TOOL, TOOL) is None
        guard.ease(TOOL, (0.4, 0.0, 0.08))
    assert guard.is_in_contact


@pytest.mark.parametrize("wanted", [(0.4, 0.0, 0.12), (0.41, 0.0, 0.1)])
def test_lifting_or_sliding_away_ends_contact(guard, wanted):
    guard.reseat((0.0, 0.0, LIMIT + 1.0), TOOL, TOOL, BELOW)
    assert guard.ease(TOOL, wanted) == (wanted, False)
    assert not guard.is_in_contact


def test_sinking_ends_contact(guard):
    guard.reseat((0.0, 0.0, LIMIT + 1.0), TOOL, TOOL, BELOW)
    guard.reseat(FREE, (0.4, 0.0, 0.095), TOOL, BELOW)
    assert not guard.is_in_contact


def test_a_lasting_push_from_the_side_stops_the_slide_but_is_not_contact(guard):
    push, target = (-LIMIT - 1.0, 0.0, 0.0), (0.42, 0.0, 0.1)
    assert guard.reseat(push, TOOL, TOOL, target) is None
    assert guard.reseat(push, TOOL, TOOL, target) == TOOL
    assert not guard.is_in_contact


def test_a_push_from_the_side_lets_the_tool_go_where_it_pushes(guard):
    push, away = (-LIMIT - 1.0, 0.0, 0.0), (0.38, 0.0, 0.1)
    guard.reseat(push, TOOL, TOOL, away)
    assert guard.reseat(push, TOOL, TOOL, away) is None


def test_a_reset_forgets_contact(guard):
    guard.reseat((0.0, 0.0, LIMIT + 1.0), TOOL, TOOL, BELOW)
    guard.reset()
    assert not guard.is_in_contact


@pytest.mark.parametrize(
    ("force", "free"),
    [((0.0, 0.0, LIMIT), True), ((0.0, 0.0, LIMIT + 1e-9), False), ((LIMIT + 0.1, 0.0, 0.0), False), (FREE, True)],
)
def test_no_more_than_the_limit_is_free(guard, force, free):
    assert guard.is_free(force) is free


def test_held_or_pushed_back_is_not_free_even_without_force(guard):
    guard.reseat((LIMIT + 1.0, 0.0, 0.0), TOOL, TOOL, TOOL)
    assert not guard.is_free(FREE)
    guard.reseat(FREE, TOOL, TOOL, TOOL)
    assert guard.is_free(FREE)
    guard.reseat((0.0, 0.0, LIMIT + 1.0), TOOL, TOOL, BELOW)
    assert not guard.is_free(FREE)
