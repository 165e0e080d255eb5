"""Scenes as Gymnasium environments: what the library asks of one, and what an episode is."""

from importlib.resources import files

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import learning.environments
from config.errors import ConfigError
from config.sources import shipped_names
from learning.environments.registration import register_scenes, scene_id
from learning.environments.scene import SceneEnv

UP = np.array([0.0, 0.0, 1.0], dtype=np.float32)


@pytest.fixture(scope="module")
def env():
    made = SceneEnv()
    yield made
    made.close()


def test_every_shipped_scenario_is_registered_twice_over_and_once():
    before = [name for name in gymnasium.registry if name.startswith("autotelic/")]
    register_scenes()
    assert [name for name in gymnasium.registry if name.startswith("autotelic/")] == before
    names = [*shipped_names("scenarios"), "scene"]
    assert sorted(before) == sorted(scene_id(name, is_flat=is_flat) for name in names for is_flat in (True, False))
    assert learning.environments.SceneEnv is SceneEnv


def test_gymnasiums_own_check_finds_nothing(env):
    check_env(env, skip_render_check=True, skip_close_check=True)


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped_names("scenarios"))
def test_nor_of_any_scene_by_its_id_and_the_flat_row_is_of_its_own_space(name):
    with gymnasium.make(scene_id(name, is_flat=False)) as made:
        check_env(made.unwrapped)
    with gymnasium.make(scene_id(name, is_flat=True)) as made:
        for seen in (made.reset(seed=2)[0], made.step(made.action_space.sample())[0]):
            assert made.observation_space.contains(seen)


def test_an_episode_has_the_time_steps_of_an_epoch_and_wants_what_it_is_asked_to(env):
    seen, info = env.reset(seed=3, options={"goal": 4, "epoch": 1000})
    assert (info["goal"], info["epoch"], env.n_steps_most) == (4, 1000, 8 * 70)
    assert seen["desired_goal"].tolist() == [0, 0, 0, 0, 1, 0]
    env.n_steps_most = 3
    told = [env.step(UP) for _ in range(3)]
    assert [(reward, is_there, is_over) for _, reward, is_there, is_over, _ in told] == [
        (-1.0, False, False), (-1.0, False, False), (-1.0, False, True),
    ]  # fmt: skip
    env.n_steps_most = 560
    assert env.reset()[1]["epoch"] == 1000


@pytest.mark.parametrize(
    ("options", "why"), [({"goal": 6}, "from 0 to 5"), ({"goal": -1}, "from 0 to 5"), ({"rules": 1}, "goal and epoch")]
)
def test_what_no_episode_can_want_is_refused(env, options, why):
    with pytest.raises(ValueError, match=why):
        env.reset(options=options)


def test_a_rig_that_runs_by_the_wall_clock_is_refused():
    with pytest.raises(ConfigError, match="lock-step"):
        SceneEnv(rig="virtual_lab")


@pytest.mark.slow
def test_a_button_that_is_pressed_is_a_goal_that_came_about(tmp_path):
    still = (
        (files("config") / "scenarios" / "paper.yaml").read_text().replace("spread_m: [0.03, 0.03]", "spread_m: [0, 0]")
    )
    (tmp_path / "still.yaml").write_text(still)
    env = SceneEnv(str(tmp_path / "still.yaml"))
    seen, _ = env.reset(seed=5, options={"goal": 1})
    for _ in range(200):
        seen, reward, is_there, is_over, info = env.step(_towards(seen))
        if is_there or is_over:
            break
    assert (is_there, reward, info["is_success"]) == (True, 0.0, True)
    assert seen["achieved_goal"][1] == 1.0
    env.close()


def _towards(seen):
    """Go over the green button where its scenario places it, then down."""
    away = np.array([0.295, 0.0]) - seen["observation"][24:26]
    if np.hypot(*away) > 0.01:
        return np.array([*np.clip(10.0 * away, -1, 1), 1.0])
    return np.array([0.0, 0.0, -1.0])


@pytest.mark.slow
def test_same_seed_same_actions_same_episode_side_by_side_in_processes():
    def made():
        return gymnasium.make("learning.environments:autotelic/workshop-flat-v0")

    alone = made()
    actions = alone.action_space
    actions.seed(1)
    asked = [actions.sample() for _ in range(30)]
    first, _ = alone.reset(seed=11)
    rows = [first, *(alone.step(action)[0] for action in asked)]
    alone.close()
    with_others = gymnasium.vector.AsyncVectorEnv([made, made], context="spawn")
    both, _ = with_others.reset(seed=[11, 12])
    there = [both[0], *(with_others.step(np.array([action, action]))[0][0] for action in asked)]
    with_others.close()
    assert np.array_equal(rows, there)
