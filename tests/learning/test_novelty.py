import numpy as np
import pytest

from config.learning import ForwardModel, Novelty
from config.loader import load_scenario
from learning.forward_model import GeometricModel
from learning.networks import width
from learning.novelty import Curiosity, NoveltyMemory
from robot.messages import Heading
from tests.support.kinematic_table import KinematicTable

SCALES_M = (0.1, 0.03)


def row(*values: float) -> np.ndarray:
    return np.array(values, dtype=np.float32)


def test_novelty_is_the_distance_to_the_nearest_remembered_by_hand():
    memory = NoveltyMemory(4, 2)
    memory.add(row(0.0, 0.0))
    memory.add(row(3.0, 0.0))
    assert memory.novelty(np.array([[0.0, 4.0], [3.0, 1.0]], dtype=np.float32)).tolist() == pytest.approx([4.0, 1.0])


def test_at_first_everything_is_equally_new():
    novelty = NoveltyMemory(4, 2).novelty(np.array([[0.0, 0.0], [9.0, 9.0]], dtype=np.float32))
    assert novelty[0] == novelty[1] > 0.0


def test_what_is_older_than_the_capacity_is_new_again():
    memory = NoveltyMemory(2, 1)
    for value in (0.0, 5.0, 6.0):
        memory.add(row(value))
    assert memory.novelty(row(0.0)[None])[0] == pytest.approx(5.0)


def test_saved_and_loaded_it_finds_the_same_new():
    memory, loaded = NoveltyMemory(3, 2), NoveltyMemory(3, 2)
    rng = np.random.default_rng(0)
    for _ in range(5):
        memory.add(rng.normal(size=2).astype(np.float32))
    loaded.load_state_dict(memory.state_dict())
    for each in (memory, loaded):
        each.add(row(0.5, 0.5))
    x = rng.normal(size=(6, 2)).astype(np.float32)
    assert (memory.novelty(x) == loaded.novelty(x)).all()


def explore(seed: int, n_steps: int) -> list[tuple[bool, ...]]:
    """Let curiosity alone move the arm over one table with open lids; return the goals held after each step."""
    table = KinematicTable(load_scenario("paper"))
    rng = np.random.default_rng(seed)
    forward = GeometricModel(ForwardModel(), table.spec, np.random.default_rng(0))
    memory = NoveltyMemory(200, width(table.spec.n_distances, table.spec.n_buttons, SCALES_M))
    curiosity = Curiosity(Novelty(), table.spec, forward=forward, memory=memory, scales_m=SCALES_M, rng=rng)
    percept = table.reset(seed=seed, epoch=0)
    forward.begin(percept)
    held = []
    for _ in range(n_steps):
        x, y, height = curiosity.act(percept).tolist()
        intent = Heading(heading_rad=float(np.arctan2(y, x)), distance_m=float(np.hypot(x, y)), height_m=height)
        result = table.step(intent)
        forward.observe(intent, result, is_learning=True)
        percept = result.percept
        held.append(table.achieved())
    return held


def test_curiosity_alone_comes_upon_most_goals_by_accident():
    met = np.any([explore(seed, 1200) for seed in range(2)], axis=(0, 1))
    assert met.sum() >= 4, met


def test_the_same_seed_explores_the_same_way():
    assert explore(3, 150) == explore(3, 150)
