"""What slides at things low over the table, empty or full, presses by no more than the lasting force bears."""

import math

import numpy as np
import pytest

from config.limit_checks import PUSH_N_S_M
from config.limited import limited
from config.loader import resolve
from robot.messages import Grip, Twist
from robot.teleop import Send
from robot.teleop.aimed import towards
from sim_twin.checking.ring import Ring
from sim_twin.perturb import PERTURBATIONS

pytestmark = pytest.mark.slow

N_STREAMS, N_COMMANDS = 6, 700
OVER_M, HEIGHTS_M = 0.25, (0.02, 0.09)
FASTER = 2.5
"""Than the tool may go: a driver who leans on the stick."""


def slides(look, arena, rng, *, is_full):
    """Lead the tool beside things, low, and slide at them at full speed, again and again; with something held first."""
    grip = Grip.CLOSE if is_full else None
    if is_full:
        x, y, z = arena.loose_m[int(rng.integers(len(arena.loose_m)))]
        yield from towards(look, np.array([x, y, OVER_M]), arena, rng, n=120, grip=Grip.OPEN)
        yield from towards(look, np.array([x, y, z]), arena, rng, n=60, grip=Grip.OPEN)
        yield from towards(look, np.array([x, y, z]), arena, rng, n=40, grip=grip, stay=True)
        yield from towards(look, np.array([x, y, OVER_M]), arena, rng, n=60, grip=grip)
    while True:
        thing = np.array(arena.things_m[int(rng.integers(len(arena.things_m)))][:2])
        angle, away_m, height_m = rng.uniform(-np.pi, np.pi), rng.uniform(0.1, 0.22), rng.uniform(*HEIGHTS_M)
        beside = thing + away_m * np.array([math.cos(angle), math.sin(angle)])
        yield from towards(look, np.array([*beside, OVER_M]), arena, rng, n=80, grip=grip)
        yield from towards(look, np.array([*beside, height_m]), arena, rng, n=60, grip=grip)
        way = thing - beside + 0.02 * rng.normal(size=2)
        x, y = FASTER * arena.speed_m_s * way / np.linalg.norm(way)
        for _ in range(70):
            yield Send(Twist(linear_m_s=(float(x), float(y), 0.0), grip=grip))


@pytest.mark.parametrize("is_full", [False, True], ids=["empty", "full"])
@pytest.mark.parametrize("plant", ["nominal", "lag_x2"])
def test_what_slides_at_things_presses_by_no_more_than_its_speed_is_held_to_for(plant, is_full):
    resolved = resolve(rig="twin")
    by = next(p for p in PERTURBATIONS if p.name == plant)
    most_n = PUSH_N_S_M * limited(resolved.arm, resolved.profile).motion.guarded_speed_m_s
    ring = Ring(resolved, by, resolved.profile, n_commands=N_COMMANDS)
    pressed_n = []
    try:
        for k in range(N_STREAMS):
            came = ring.run(
                lambda look, arena, k=k: slides(look, arena, np.random.default_rng([7, k]), is_full=is_full),
                number=k, family="slides", seed=k,
            )  # fmt: skip
            assert not came.broken
            pressed_n += [r.value for r in came.readings if r.limit == "steady_force"]
    finally:
        ring.close()
    assert 20.0 < max(pressed_n) < most_n
