"""The quick film: what `develop` makes of sharp light, but for where its noise is from."""

import msgspec
import numpy as np
import pytest

from config.loader import resolve
from robot.frames import CameraSpec
from sim_twin.film import Film
from sim_twin.lens import directions, half_angles, source_map
from sim_twin.plant import TwinPlant
from sim_twin.rendered_camera import Optics, RenderedCamera, develop, sampled
from sim_twin.studio.viewing import RIG_VIEW

TANGENTS = directions(RIG_VIEW.lens)
PLACES = source_map(TANGENTS, half_angles(TANGENTS), (640, 480))


def film(seed=1, *, read_noise=1.5, shot_noise=0.02):
    return Film(read_noise=read_noise, shot_noise=shot_noise, rng=np.random.default_rng(seed))


def ramp():
    """Return a picture with every level, edges and corners."""
    rng = np.random.default_rng(3)
    return rng.integers(0, 256, (480, 640, 3), dtype=np.uint8)


def test_without_noise_a_quick_film_s_picture_is_the_slow_one_s():
    picture = ramp()
    slow = develop(sampled(picture, PLACES), Optics(), np.random.default_rng(0)).astype(int)
    quick = film(read_noise=0.0, shot_noise=0.0).expose(picture, PLACES).astype(int)
    assert np.abs(quick - slow).max() <= 1, "a half is rounded up here, to even there"
    assert (quick != slow).mean() < 1e-3


@pytest.mark.parametrize("level", [0, 1, 60, 200, 254, 255])
def test_a_quick_film_s_noise_is_as_strong_and_as_cut_off_as_the_slow_one_s(level):
    picture, optics = np.full((480, 640, 3), level, np.uint8), Optics(read_noise=1.5, shot_noise=0.02)
    slow = develop(np.full((480, 640, 3), float(level)), optics, np.random.default_rng(0))
    quick = film().expose(picture, PLACES)
    assert quick.mean() == pytest.approx(slow.mean(), abs=0.02)
    assert quick.std() == pytest.approx(slow.std(), rel=0.01)


def test_noise_of_neighbours_in_place_colour_and_time_has_nothing_to_do_with_one_another():
    picture, made = np.full((480, 640, 3), 128, np.uint8), film()
    first, second = (made.expose(picture, PLACES).astype(float) - 128.0 for _ in range(2))
    pairs = [(first[1:], first[:-1]), (first[:, 1:], first[:, :-1]), (first[..., 1], first[..., 0]), (first, second)]
    for one, other in pairs:
        assert abs(np.corrcoef(one.ravel(), other.ravel())[0, 1]) < 0.01


def test_the_same_seed_exposes_the_same_and_another_something_else():
    picture = ramp()
    one, same, other = (film(seed).expose(picture, PLACES) for seed in (1, 1, 2))
    assert np.array_equal(one, same)
    assert not np.array_equal(one, other)


@pytest.mark.parametrize("optics", [{"n_smear": 2}, {"defocus_px": 0.5}, {"exposure": 1.1}])
def test_a_quick_film_is_refused_for_light_that_it_would_show_otherwise(optics):
    resolved = resolve()
    world = TwinPlant(arm=resolved.arm, scenario=resolved.scenario, rig=resolved.rig).world
    spec = CameraSpec(name="table", serial="", width_px=640, height_px=480, rate_hz=20.0)

    def camera(chosen):
        return RenderedCamera(
            model=world.model, data=world.data, spec=spec, lens=RIG_VIEW.lens, T_bc=RIG_VIEW.T_bc, optics=chosen,
            rng=np.random.default_rng(0), film=film(),
        )  # fmt: skip

    camera(Optics())
    with pytest.raises(ValueError, match="for a quick film"):
        camera(msgspec.structs.replace(Optics(), **optics))
