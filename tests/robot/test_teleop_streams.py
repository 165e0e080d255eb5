import itertools
import math

import numpy as np
import pytest

from robot.messages import GripCommand, Heading, Hold, JointTarget, Twist, Vec3
from robot.safety.checks import check_intent
from robot.teleop import Arena, Battery, Seen, Send, Silence, Write
from robot.teleop.battery import FAMILIES, LATE
from robot.teleop.human import minimum_jerk
from robot.teleop.search import Candidates, played
from robot.teleop.weighing import ASIDE_M, ASIDE_M_N, SINKING_M

HOME = (2.8186, -1.7634, 2.014, -1.8213, -1.5708, -1.8938)
GRIP = GripCommand(opening_m=0.085, force_n=235.0, speed_m_s=0.15)
ARENA = Arena(
    tick_s=0.01, speed_m_s=0.25, box_m=((0.24, -0.36, 0.015), (0.64, 0.36, 0.32)), q_min_rad=(-6.28,) * 6,
    q_max_rad=(6.28,) * 6, qd_max_rad_s=(1.0,) * 6, home_rad=HOME, things_m=((0.3, 0.0, 0.05), (0.5, 0.2, 0.12)),
    loose_m=((0.54, 0.25, 0.04),), fences_m=((0.0, 0.0, 0.0),), grip=(GRIP, GRIP),
    grip_least=GripCommand(opening_m=0.0, force_n=20.0, speed_m_s=0.02),
)  # fmt: skip
BATTERY = Battery(seed=3, n_streams=300, n_plants=6)
HOSTILE = ("not_finite", "malformed")
N = 250


def still() -> Seen:
    return Seen(q_rad=HOME, tcp_m=(0.4, 0.0, 0.2), force_n=(0.0, 0.0, 0.0))


def asks(family: str, seed: int = 0, n: int = N) -> list:
    return list(itertools.islice(FAMILIES[family](still, ARENA, np.random.default_rng(seed)), n))


@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_the_same_seed_is_the_same_stream_and_another_is_another(family):
    assert repr(asks(family)) == repr(asks(family))
    assert repr(asks(family)) != repr(asks(family, seed=1))


@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_a_stream_never_ends_and_asks_only_what_can_be_asked(family):
    came = asks(family)
    assert len(came) == N
    assert all(isinstance(ask, Send | Silence | Write) for ask in came)


@pytest.mark.parametrize("family", sorted(set(FAMILIES) - set(HOSTILE)))
def test_streams_that_are_not_meant_to_be_refused_send_intents_that_are_admitted(family):
    intents = [ask.intent for ask in asks(family) if isinstance(ask, Send)]
    assert [check_intent(intent) for intent in intents if check_intent(intent) is not None] == []


@pytest.mark.parametrize("family", HOSTILE)
def test_hostile_streams_send_what_must_be_refused_within_a_stream(family):
    assert any(check_intent(ask.intent) is not None for ask in asks(family) if isinstance(ask, Send))


def test_all_kinds_of_intent_and_both_grips_are_sent():
    kinds = {type(ask.intent) for f in FAMILIES for ask in asks(f) if isinstance(ask, Send)}
    assert {Heading, Twist, JointTarget, Hold} <= kinds
    grips = {getattr(ask.intent, "grip", None) for f in ("mixed", "grasps") for ask in asks(f)}
    assert len(grips) == 3


def test_commands_to_the_gate_run_backwards_in_number_and_in_time():
    writes = [ask for ask in asks("backwards", n=2000) if isinstance(ask, Write)]
    assert {w.sequence_off for w in writes} >= {0, -1, -7, 1}
    assert min(w.stamp_off_ns for w in writes) < 0 < max(w.stamp_off_ns for w in writes)


def test_a_minimum_jerk_reach_covers_its_length_at_rest_at_both_ends():
    n = 1000
    assert sum(minimum_jerk((k + 0.5) / n) for k in range(n)) / n == pytest.approx(1.0, abs=1e-6)
    assert minimum_jerk(0.0) == minimum_jerk(1.0) == minimum_jerk(-0.5) == minimum_jerk(1.5) == 0.0
    assert max(minimum_jerk(k / n) for k in range(n)) == pytest.approx(1.875)


def test_a_person_stays_below_the_speed_that_is_allowed_but_for_tremor():
    twists = [ask.intent for ask in asks("reaches", n=3000) if isinstance(ask.intent, Twist)]
    speeds = [math.hypot(*t.linear_m_s) for t in twists]
    assert 0.3 * ARENA.speed_m_s < max(speeds) < ARENA.speed_m_s


def test_every_number_has_one_place_and_families_meet_every_plant():
    battery = Battery(seed=3, n_streams=600, n_plants=6)
    places = [battery.place(k) for k in range(battery.n_plain)]
    assert {(p.family, p.plant) for p in places} == set(itertools.product(FAMILIES, range(6)))
    blocks = BATTERY.searches()
    assert [b.first for b in blocks] == list(range(BATTERY.n_plain, 300, Candidates.BLOCK))
    assert sum(b.n_streams for b in blocks) + BATTERY.n_plain == 300


def test_families_that_came_later_have_the_last_numbers_and_changed_no_others():
    names = [BATTERY.place(k).family for k in range(BATTERY.n_plain)]
    first = next(k for k, name in enumerate(names) if name in LATE)
    assert names[:first] == list(itertools.islice(itertools.cycle(f for f in FAMILIES if f not in LATE), first))
    assert set(names[first:]) == set(LATE)


def writes(family: str, look=still, seed: int = 0) -> list[Write]:
    came = itertools.islice(FAMILIES[family](look, ARENA, np.random.default_rng(seed)), 400)
    return [ask for ask in came if isinstance(ask, Write)]


@pytest.mark.parametrize("seed", range(8))
def test_who_creeps_goes_one_way_and_slowly_at_the_gate(seed):
    steps = np.diff([w.q_rad for w in writes("gate_creeps", seed=seed)][:100], axis=0)
    assert 1e-5 < np.abs(steps).max() < 0.004
    ways = steps / np.abs(steps).max(axis=1, keepdims=True)
    assert np.abs(ways - ways[0]).max() < 1e-6


def test_who_creeps_begins_anew_after_a_latch():
    def latched() -> Seen:
        return Seen(q_rad=HOME, tcp_m=(0.4, 0.0, 0.2), force_n=(0.0, 0.0, 0.0), is_latched=True)

    assert all(writes(family, latched) == [] for family in ("gate_creeps", "gate_leans", "gate_weighs"))


def test_who_leans_on_something_goes_on_more_slowly_once_it_bears():
    def borne() -> Seen:
        return Seen(q_rad=HOME, tcp_m=(0.4, 0.0, 0.2), force_n=(0.0, 0.0, 20.0))

    free, held = (np.diff([w.q_rad for w in writes("gate_leans", look)][20:60], axis=0) for look in (still, borne))
    assert np.abs(held).max() < 0.6 * np.abs(free).max()


class Bent:
    """An arm whose joints lead its tool by a matrix, and on which something presses wherever it is."""

    JACOBIAN = np.array(
        [[0.0, 0.5, 0.2, 0.1, 0.0, 0.0], [0.4, 0.0, 0.0, 0.0, 0.1, 0.0], [0.0, 0.3, -0.4, 0.1, 0.0, 0.0]]
    )

    def __init__(self, force_n: Vec3) -> None:
        self.q, self.at, self.force_n = np.array(HOME), np.array([0.4, 0.0, 0.2]), force_n

    def look(self) -> Seen:
        return Seen(q_rad=tuple(self.q), tcp_m=tuple(self.at), force_n=self.force_n)

    def meet(self, ask) -> None:
        by_m = np.zeros(3)
        if isinstance(ask, Write):
            by_m = self.JACOBIAN @ (np.array(ask.q_rad) - self.q)
        elif isinstance(ask.intent, Twist):
            by_m = np.array(ask.intent.linear_m_s) * ARENA.tick_s * ask.n_ticks
        self.q = self.q + np.linalg.pinv(self.JACOBIAN) @ by_m
        self.at = self.at + by_m


def weighed(*force_n: float) -> np.ndarray:
    """Return how the tool went in each tick in which it was written to, once that had begun well."""
    arm, steps = Bent(force_n), []
    for ask in FAMILIES["gate_weighs"](arm.look, ARENA, np.random.default_rng(0)):
        before = arm.at
        arm.meet(ask)
        steps += [arm.at - before] * isinstance(ask, Write)
        if len(steps) == 60:
            return np.array(steps[20:])
    raise AssertionError("a stream never ends")


def test_who_weighs_a_thing_down_goes_straight_down_and_slowly_once_it_bears():
    free, borne, twice = weighed(0.0, 0.0, 5.0), weighed(0.0, 0.0, 20.0), weighed(0.0, 0.0, 40.0)
    assert free[:, 2] == pytest.approx(-SINKING_M, rel=1e-6)
    assert 0.0 < -borne[:, 2].min() < 0.1 * SINKING_M
    assert twice == pytest.approx(2.0 * borne, abs=1e-9)
    assert np.abs(np.concatenate([free, borne])[:, :2]).max() < 1e-9


def test_who_weighs_a_thing_down_gives_way_to_what_pushes_aside():
    pushed, harder = weighed(5.0, -5.0, 20.0)[:, :2], weighed(500.0, 0.0, 20.0)[:, :2]
    assert pushed == pytest.approx(np.tile([5.0 * ASIDE_M_N, -5.0 * ASIDE_M_N], (40, 1)), rel=1e-6)
    assert harder[:, 0] == pytest.approx(ASIDE_M, rel=1e-6)


def test_a_hand_is_asked_for_less_than_the_least_and_more_than_the_most():
    grips = [w.grip for seed in range(40) for w in writes("gate_hands", seed=seed)]
    least, most = ARENA.grip_least, ARENA.grip[0]
    for name in ("force_n", "speed_m_s"):
        asked = [getattr(grip, name) for grip in grips]
        assert min(asked) < getattr(least, name) < getattr(most, name) < max(asked)
    assert max(grip.opening_m for grip in grips) > most.opening_m


def test_streams_of_different_numbers_are_drawn_apart():
    draws = {BATTERY.rng(k).integers(1 << 60) for k in range(300)}
    assert len(draws) == 300
    assert Battery(seed=4, n_streams=300, n_plants=6).rng(0).integers(1 << 60) not in draws


@pytest.mark.parametrize("seed", range(5))
def test_a_search_comes_nearer_to_what_scores_low(seed):
    candidates, scores = Candidates(np.random.default_rng(seed)), []
    for _ in range(Candidates.BLOCK):
        knots = candidates.propose()
        scores.append(float(np.abs(knots - 1.5).mean()))
        candidates.learn(knots, scores[-1])
    assert min(scores) < min(scores[:8]) - 0.02


def test_a_candidate_is_always_played_the_same():
    knots = Candidates(np.random.default_rng(0)).propose()
    first, again = (list(itertools.islice(played(knots, still, ARENA), 400)) for _ in range(2))
    assert first == again
    assert {type(ask.intent) for ask in first} == {Twist, JointTarget}
