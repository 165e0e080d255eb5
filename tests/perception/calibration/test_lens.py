"""Points to pixels and back, held to OpenCV's projection, which is no part of it."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from perception.calibration.lens import Lens, fold_radius, intersect_height, project, ray_jacobian, rays
from perception.calibration.poses import carried, inverse, matrix_of, pose_of, rigid_fit, rotation, rotation_vector
from tests.support.boards import LENS, matrices, turned

coefficient = st.floats(-0.2, 0.2)
tangential = st.floats(-0.003, 0.003)
share = st.floats(0.0, 1.0)
component = st.floats(-3.0, 3.0)


@st.composite
def lenses(draw):
    return Lens(
        width_px=1280, height_px=720, fx_px=draw(st.floats(600, 1500)), fy_px=draw(st.floats(600, 1500)),
        cx_px=draw(st.floats(560, 720)), cy_px=draw(st.floats(300, 420)), k1=draw(coefficient),
        k2=draw(st.floats(-0.05, 0.05)), p1=draw(tangential), p2=draw(tangential), k3=draw(st.floats(-0.01, 0.01)),
    )  # fmt: skip


@given(lenses(), share, share, st.floats(0.1, 5.0))
def test_a_pixels_ray_is_seen_at_that_pixel_at_any_depth_or_has_none(lens, across, down, depth_m):
    pixel = np.array([[across * (lens.width_px - 1), down * (lens.height_px - 1)]])
    direction = rays(lens, pixel)
    if np.isnan(direction).any():
        assert np.hypot(*(pixel[0] - (lens.cx_px, lens.cy_px))) > 0.5 * lens.fx_px * min(1.0, fold_radius(lens))
    else:
        assert project(lens, direction * depth_m) == pytest.approx(pixel, abs=1e-6)


@given(lenses(), st.floats(-0.5, 0.5), st.floats(-0.4, 0.4), st.floats(0.2, 4.0))
def test_points_are_projected_where_opencv_does_it(lens, x, y, z):
    point = np.array([[x * z, y * z, z]])
    if np.hypot(x, y) >= fold_radius(lens):
        assert np.isnan(project(lens, point)).all()
        return
    matrix, bent = matrices(lens)
    there = cv2.projectPoints(point, np.zeros(3), np.zeros(3), matrix, bent)[0].reshape(1, 2)
    assert project(lens, point) == pytest.approx(there, abs=1e-6)


@given(lenses(), st.floats(-0.4, 0.4), st.floats(-0.3, 0.3))
def test_the_jacobian_is_that_of_differences(lens, x, y):
    plain = Lens(
        width_px=1280, height_px=720, fx_px=1.0, fy_px=1.0, cx_px=0.0, cy_px=0.0,
        k1=lens.k1, k2=lens.k2, p1=lens.p1, p2=lens.p2, k3=lens.k3,
    )  # fmt: skip
    if np.hypot(x, y) > 0.9 * fold_radius(lens):
        return
    h = 1e-6
    ends = np.array([[x + h, y, 1], [x - h, y, 1], [x, y + h, 1], [x, y - h, 1]])
    at = project(plain, ends)
    J = np.stack([(at[0] - at[1]) / (2 * h), (at[2] - at[3]) / (2 * h)], axis=1)
    assert ray_jacobian(plain, np.array([[x, y]]))[0] == pytest.approx(J, abs=1e-6)


@pytest.mark.parametrize("z", [0.0, -0.0, -1.0, 1e-9, np.nan])
def test_what_is_not_in_front_of_the_lens_is_not_seen(z):
    assert np.isnan(project(LENS, np.array([[0.0, 0.0, z]]))).all()


def test_beyond_the_fold_nothing_is_seen_and_before_it_everything():
    lens = Lens(width_px=640, height_px=480, fx_px=500, fy_px=500, cx_px=320, cy_px=240, k1=-0.3)
    limit = fold_radius(lens)
    assert limit == pytest.approx(np.sqrt(1 / 0.9))
    before, at = np.nextafter(limit, 0), limit
    assert np.isfinite(project(lens, np.array([[before, 0.0, 1.0]]))).all()
    assert np.isnan(project(lens, np.array([[at, 0.0, 1.0]]))).all()
    assert np.isnan(rays(lens, np.array([[320 + 500 * limit, 240.0]]))[0, :2]).all()


@given(component, component, component, share, share, st.floats(-0.1, 0.3))
def test_a_ray_meets_the_plane_where_the_camera_sees_that_point(rx, ry, rz, across, down, height_m):
    T_bc = turned((rx, ry, rz), (0.2, -0.4, 1.1))
    pixel = np.array([[across * 1279, down * 719]])
    found = intersect_height(T_bc, rays(LENS, pixel), height_m)
    if np.isnan(found).any():
        assert (rays(LENS, pixel) @ T_bc[:3, :3].T)[0, 2] >= 0.0  # looks level or up, the camera being above
    elif abs(found).max() < 1e3:
        assert found[0, 2] == height_m
        assert project(LENS, carried(inverse(T_bc), found)) == pytest.approx(pixel, abs=1e-5)


@given(component, component, component)
def test_a_turn_survives_vector_matrix_and_quaternion(rx, ry, rz):
    R = rotation(np.array([rx, ry, rz]))
    assert pytest.approx(np.eye(3), abs=1e-12) == R @ R.T
    assert rotation(rotation_vector(R)) == pytest.approx(R, abs=1e-9)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, (0.1, -0.2, 0.3)
    assert matrix_of(pose_of(T)) == pytest.approx(T, abs=1e-9)
    assert pytest.approx(cv2.Rodrigues(np.array([rx, ry, rz]))[0], abs=1e-9) == R


@given(component, component, component, st.floats(0.5, 2.0))
def test_points_turned_moved_and_stretched_are_fitted(rx, ry, rz, scale):
    T = turned((rx, ry, rz), (0.5, -0.1, 0.2))
    points = np.array([[0, 0, 0], [0.2, 0, 0], [0, 0.15, 0], [0.2, 0.16, 0.0]])
    found, stretched = rigid_fit(points, carried(T, points * scale))
    assert stretched == pytest.approx(scale, rel=1e-9)
    assert found[:3, :3] == pytest.approx(T[:3, :3], abs=1e-9)
