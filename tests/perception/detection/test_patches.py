"""Patches of a mask against OpenCV's own, and medians against NumPy's."""

import cv2
import numpy as np
import pytest

from perception.detection.patches import components, median_colour


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.6, 1.0])
@pytest.mark.parametrize("shape", [(1, 1), (1, 40), (37, 23)])
def test_patches_are_those_that_opencv_finds(share, shape):
    mask = (np.random.default_rng(3).uniform(size=shape) < share).astype(np.uint8)
    labels, rows = components(mask)
    n, theirs, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=4)
    assert len(rows) == n - 1
    assert ((labels > 0) == (mask > 0)).all()
    pairs = set(zip(labels.ravel().tolist(), theirs.ravel().tolist(), strict=True))
    assert len(pairs - {(0, 0)}) == n - 1, "one of ours is one of theirs"
    for mine, their in pairs - {(0, 0)}:
        left, upper, width, height, area = stats[their].tolist()
        assert rows[mine - 1].tolist() == [left, upper, left + width - 1, upper + height - 1, area]


def test_a_median_colour_is_of_the_pixels_under_the_mask_alone():
    rng = np.random.default_rng(5)
    picture = rng.integers(0, 256, (30, 40, 3), dtype=np.uint8)
    mask = (rng.uniform(size=(9, 12)) < 0.4).astype(np.uint8)
    part = picture[7:16, 20:32]
    assert median_colour(picture, mask, 20, 7) == pytest.approx(np.median(part[mask > 0], axis=0))
