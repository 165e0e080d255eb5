"""Colours that stay apart: for everybody, and for those who do not see red from green, or blue from yellow."""

from itertools import combinations

import numpy as np
import pytest

from learning.palette import PALETTE, like, oklab

# Machado, Oliveira and Fernandes 2009, severity 1, on linear red, green and blue.
LACKING = {
    "red": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "green": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "blue": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
TRAFFIC_LIGHT = ((0.8, 0.1, 0.1), (0.45, 0.4, 0.05))


def seen(colours, lacking):
    coded = np.array(colours)
    linear = np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)
    shown = np.clip(linear @ np.array(LACKING[lacking]).T, 0.0, 1.0)
    return np.where(shown <= 0.0031308, 12.92 * shown, 1.055 * shown ** (1 / 2.4) - 0.055)


def nearest(colours):
    return min(np.linalg.norm(a - b) for a, b in combinations(oklab(colours), 2))


@pytest.mark.parametrize("lacking", LACKING)
def test_any_two_colours_stay_apart_for_whom_one_kind_of_cone_is_lacking(lacking):
    assert nearest(seen(PALETTE, lacking)) > 0.05


def test_that_test_would_tell_two_colours_that_do_not():
    assert nearest(TRAFFIC_LIGHT) > 0.15
    assert nearest(seen(TRAFFIC_LIGHT, "green")) < 0.6 * nearest(TRAFFIC_LIGHT)


def test_every_colour_shows_on_white():
    assert oklab(PALETTE)[:, 0].max() < 0.8


@pytest.mark.parametrize(
    ("colour", "expected"),
    [
        ((1.0, 1.0, 1.0), (1.0, 0.0, 0.0)),
        ((1.0, 0.0, 0.0), (0.628, 0.2249, 0.1258)),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ],
)
def test_oklab_is_what_its_author_prints(colour, expected):
    assert oklab([colour])[0] == pytest.approx(expected, abs=1e-3)


def test_goals_get_colours_like_their_things_and_each_its_own():
    things = [(0.95, 0.5, 0.08), (0.13, 0.67, 0.28), (0.12, 0.35, 0.85), (0.82, 0.10, 0.10), (0.10, 0.20, 0.75)]
    orange, green, blue, red, blue_too = like(things)
    assert (orange, green, red) == (PALETTE[3], PALETTE[2], PALETTE[1])
    assert {blue, blue_too} == {PALETTE[0], PALETTE[5]}
    assert len(set(like([(0.5, 0.5, 0.5)] * 7))) == 7
    assert len(like([(0.5, 0.5, 0.5)] * 9)) == 9
