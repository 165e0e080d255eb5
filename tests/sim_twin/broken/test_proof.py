"""What shows that a fault was there: its figures do, those of an arm without it, or with half of it, do not."""

import msgspec
import numpy as np
import pytest

from robot.hal.ur_primary import ArmFacts
from sim_twin.broken.proof import Sight, shows_bias, shows_dh, shows_lag, shows_late, shows_noise, shows_weight
from sim_twin.broken.trials import TRIALS
from sim_twin.broken.witness import Seen

N = 80
ZERO = (0.0,) * 6
NOMINAL = ArmFacts(
    theta_rad=ZERO, a_m=ZERO, d_m=ZERO, alpha_rad=ZERO, q_min_rad=ZERO, q_max_rad=ZERO, qd_max_rad_s=ZERO, q_rad=ZERO,
    tcp_pose=ZERO, tcp_offset=ZERO,
)  # fmt: skip
RNG = np.random.default_rng(7)
UNIT = RNG.normal(0.0, 1.0, (N, 6))
UNIT /= UNIT.std(axis=0)
ROWS = tuple(map(tuple, (RNG.uniform(0.5, 1.0, (6, 4)) * 1e-3).tolist()))


def seen(*, lag_s=0.002, q_off_rad=0.0, pulled_n=0.0, payload_kg=0.93, period_s=0.002, n=N):
    return Seen(
        lag_s=np.full(n, 1.0) * lag_s,
        q_off_rad=np.zeros((n, 6)) + (q_off_rad if np.isscalar(q_off_rad) else np.asarray(q_off_rad)[:n]),
        force_n=np.tile([0.0, 0.0, -pulled_n], (n, 1)),
        payload_kg=np.full(n, payload_kg),
        period_s=np.full(n, 1.0) * period_s,
    )


def facts(rows):
    a, d, alpha, theta = (tuple(column) for column in np.array(rows).T.tolist())
    return msgspec.structs.replace(NOMINAL, a_m=a, d_m=d, alpha_rad=alpha, theta_rad=theta)


def sight(during, before=None, rows=ROWS, then=None):
    return Sight(before=before or seen(), during=during, facts=(NOMINAL, then or NOMINAL), rows=rows)


BIAS = (0.02, 0.0, 0.0, 0.0, 0.0, 0.0)
THIRD_LATE = np.where(np.arange(N) % 3, 0.002, 0.003)


@pytest.mark.parametrize(
    ("shows", "there"),
    [
        (shows_lag(0.02), sight(seen(lag_s=0.021))),
        (shows_late(0.003, every=3), sight(seen(period_s=THIRD_LATE))),
        (shows_noise(1e-3), sight(seen(q_off_rad=1e-3 * UNIT))),
        (shows_bias(BIAS), sight(seen(q_off_rad=np.tile(BIAS, (N, 1))))),
        (shows_weight(3.0), sight(seen(pulled_n=29.4))),
        (shows_dh(1.0, 1.0), sight(seen(), then=facts(ROWS))),
    ],
)
def test_a_fault_that_is_there_is_seen_and_one_that_is_not_is_not(shows, there):
    assert shows(there).is_so, shows(there).shown
    assert not shows(sight(seen())).is_so
    assert not shows(Sight(before=there.during, during=seen(n=0), facts=there.facts[:1] * 2, rows=ROWS)).is_so


@pytest.mark.parametrize(
    ("shows", "wrong"),
    [
        (shows_lag(0.02), sight(seen(lag_s=0.0179))),
        (shows_lag(0.02), sight(seen(lag_s=0.021), before=seen(lag_s=0.021))),
        (shows_late(0.003, every=3), sight(seen(period_s=np.where(np.arange(N) % 6, 0.002, 0.003)))),
        (shows_late(0.003, every=3), sight(seen(period_s=THIRD_LATE), before=seen(period_s=THIRD_LATE))),
        (shows_noise(1e-3), sight(seen(q_off_rad=0.7e-3 * UNIT))),
        (shows_noise(1e-3), sight(seen(q_off_rad=1.3e-3 * UNIT))),
        (shows_noise(1e-3), sight(seen(q_off_rad=1.1e-3 * UNIT * (1, 1, 1, 1, 1, 0)))),
        (shows_noise(1e-3), sight(seen(q_off_rad=1e-3 * UNIT), before=seen(q_off_rad=1e-3 * UNIT))),
        (shows_bias(BIAS), sight(seen(q_off_rad=0.02))),
        (shows_bias(BIAS), sight(seen(q_off_rad=np.tile((0.0199, 0, 0, 0, 0, 0), (N, 1))))),
        (shows_weight(3.0), sight(seen(pulled_n=20.0))),
        (shows_weight(3.0), sight(seen(pulled_n=29.4, payload_kg=3.93))),
        (shows_dh(1.0, 1.0), sight(seen(), then=facts(np.array(ROWS) / 2))),
        (shows_dh(0.4, 1.0), sight(seen(), then=facts(ROWS))),
        (shows_dh(1.0, 1.0), sight(seen(), rows=(), then=facts(ROWS))),
        (shows_dh(1.0, 1.0), sight(seen(), rows=((0.0,) * 4,) * 6)),
    ],
)
def test_another_fault_or_one_that_was_there_before_is_not_taken_for_it(shows, wrong):
    assert not shows(wrong).is_so, shows(wrong).shown


def test_every_fault_that_is_borne_must_be_shown_or_bar_the_arm_in_its_own_words():
    borne = [trial for trial in TRIALS if not trial.is_stop]
    assert borne
    assert [trial.name for trial in borne if trial.shows is None and not (trial.bars and trial.barred_by)] == []
