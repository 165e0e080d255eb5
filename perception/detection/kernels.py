"""The arithmetic that a picture takes a million times, compiled: points to pixels, hulls, and what is inside them."""

import numpy as np

from perception.calibration.lens import Lens, fold_radius
from robot.compiled import Bytes2, Table, compiled
from robot.messages import Vec3

__all__ = ["LensNumbers", "fit_body", "hull_of", "lens_numbers", "on_plane", "paint_hull", "pixel_of", "pixels_of"]

LensNumbers = tuple[float, float, float, float, float, float, float, float, float, float]
"""fx, fy, cx, cy, k1, k2, p1, p2, k3, and the undistorted radius at which the lens folds."""
AROUND_PX = 8
"""So far about the model's outline pixels count, for its middle and against it."""
N_STEPS = 10
STILL_PX = 0.02
LEAST_GAIN = 0.6
STEP_M = 1e-4
N_NEWTON = 12
Counts = tuple[int, int, int, int, int, int, int, int]


def lens_numbers(lens: Lens) -> LensNumbers:
    """Return a lens as plain numbers."""
    return (
        lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, lens.k1, lens.k2, lens.p1, lens.p2, lens.k3, fold_radius(lens)
    )  # fmt: skip


@compiled
def pixel_of(lens: LensNumbers, T_cb: Table, x: float, y: float, z: float) -> tuple[float, float]:
    """Return where a point of the base frame is seen; not a number where it is not (perception.calibration.lens)."""
    fx, fy, cx, cy, k1, k2, p1, p2, k3, fold = lens
    depth = T_cb[2, 0] * x + T_cb[2, 1] * y + T_cb[2, 2] * z + T_cb[2, 3]
    if not depth > 1e-6:
        return np.nan, np.nan
    u = (T_cb[0, 0] * x + T_cb[0, 1] * y + T_cb[0, 2] * z + T_cb[0, 3]) / depth
    v = (T_cb[1, 0] * x + T_cb[1, 1] * y + T_cb[1, 2] * z + T_cb[1, 3]) / depth
    r2 = u * u + v * v
    if r2 >= fold * fold:
        return np.nan, np.nan
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    bent_u = u * radial + 2.0 * p1 * u * v + p2 * (r2 + 2.0 * u * u)
    bent_v = v * radial + p1 * (r2 + 2.0 * v * v) + 2.0 * p2 * u * v
    return bent_u * fx + cx, bent_v * fy + cy


@compiled
def pixels_of(lens: LensNumbers, T_cb: Table, points: Table) -> Table:
    """Return where points of the base frame are seen.  (n, 3) m -> (n, 2) px"""
    found = np.empty((points.shape[0], 2))
    for i in range(points.shape[0]):
        found[i, 0], found[i, 1] = pixel_of(lens, T_cb, points[i, 0], points[i, 1], points[i, 2])
    return found


@compiled
def hull_of(pixels: Table) -> Table:
    """Return the convex hull of points, turning one way; Andrew's monotone chain.  (n, 2) -> (m, 2)"""
    n = pixels.shape[0]
    order = np.argsort(pixels[:, 0])
    # Points of one column must come by their rows, which sorting by columns alone leaves open.
    for i in range(1, n):
        j = i
        while (
            j > 0 and pixels[order[j], 0] == pixels[order[j - 1], 0] and pixels[order[j], 1] < pixels[order[j - 1], 1]
        ):
            order[j], order[j - 1] = order[j - 1], order[j]
            j -= 1
    chain = np.empty((2 * n + 1, 2))
    m = 0
    for turn in range(2):
        start = m
        for k in range(n):
            i = order[k] if turn == 0 else order[n - 1 - k]
            x, y = pixels[i, 0], pixels[i, 1]
            while (
                m - start >= 2
                and (chain[m - 1, 0] - chain[m - 2, 0]) * (y - chain[m - 2, 1])
                - (chain[m - 1, 1] - chain[m - 2, 1]) * (x - chain[m - 2, 0])
                <= 0.0
            ):
                m -= 1
            chain[m, 0], chain[m, 1] = x, y
            m += 1
        m -= 1  # the end of one chain begins the other
    return chain[: max(m, 1)].copy()


@compiled
def span_of(outline: Table, row: float) -> tuple[int, int]:
    """Return the first and the last pixel of a row whose centres a convex outline holds; none where last < first."""
    left, right = np.inf, -np.inf
    n = outline.shape[0]
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        ax, ay, bx, by = outline[i, 0], outline[i, 1], outline[j, 0], outline[j, 1]
        if (ay <= row) != (by <= row):
            x = ax + (row - ay) / (by - ay) * (bx - ax)
            left, right = min(left, x), max(right, x)
    if right < left:
        return 0, -1
    return int(np.ceil(left)), int(np.floor(right))


@compiled
def paint_hull(mask: Bytes2, outline: Table, left: float, upper: float, value: int) -> bool:
    """Give the pixels inside a convex outline a value, in a mask whose first pixel is (left, upper); were there any?"""
    height, width = mask.shape
    low, high = np.inf, -np.inf
    for i in range(outline.shape[0]):
        low, high = min(low, outline[i, 1]), max(high, outline[i, 1])
    if not (np.isfinite(low) and np.isfinite(high)):
        return False
    is_any = False
    for row in range(max(int(np.ceil(low - upper)), 0), min(int(np.floor(high - upper)) + 1, height)):
        first, last = span_of(outline, row + upper)
        for column in range(max(first - int(left), 0), min(last - int(left) + 1, width)):
            mask[row, column] = value
            is_any = True
    return is_any


@compiled
def compared(outline: Table, seen: Bytes2, free: Bytes2, left: float, upper: float) -> Counts:
    """Return what a model's outline and a picture have where nothing stands before them, near the outline.

    Returns:
        How many pixels the model has, hidden ones too; how many that are free; how many are seen; how many are both;
        then the sums of columns and rows of the model's and of those that are seen.
    """
    height, width = seen.shape
    first_row = max(int(np.floor(outline[:, 1].min() - upper)) - AROUND_PX, 0)
    last_row = min(int(np.ceil(outline[:, 1].max() - upper)) + AROUND_PX + 1, height)
    first_column = max(int(np.floor(outline[:, 0].min() - left)) - AROUND_PX, 0)
    last_column = min(int(np.ceil(outline[:, 0].max() - left)) + AROUND_PX + 1, width)
    n_whole, n_model, n_seen, n_both = 0, 0, 0, 0
    model_u, model_v, seen_u, seen_v = 0, 0, 0, 0
    for row in range(first_row, last_row):
        a, b = span_of(outline, row + upper)
        a, b = max(a - int(left), first_column), min(b - int(left), last_column - 1)
        n_whole += max(b - a + 1, 0)
        for column in range(first_column, last_column):
            is_model = a <= column <= b
            is_seen = seen[row, column] != 0
            if free[row, column] != 0 and (is_model or is_seen):
                n_both += is_model and is_seen
                n_model, model_u, model_v = n_model + is_model, model_u + is_model * column, model_v + is_model * row
                n_seen, seen_u, seen_v = n_seen + is_seen, seen_u + is_seen * column, seen_v + is_seen * row
    return n_whole, n_model, n_seen, n_both, model_u, model_v, seen_u, seen_v


@compiled
def moved_by(lens: LensNumbers, T_cb: Table, at: Vec3, du: float, dv: float) -> tuple[float, float]:
    """Return how far along x and y a point moves whose pixel moves by so much; not numbers where none does."""
    x, y, z = at
    ahead_x, behind_x = pixel_of(lens, T_cb, x + STEP_M, y, z), pixel_of(lens, T_cb, x - STEP_M, y, z)
    ahead_y, behind_y = pixel_of(lens, T_cb, x, y + STEP_M, z), pixel_of(lens, T_cb, x, y - STEP_M, z)
    ux, vx = (ahead_x[0] - behind_x[0]) / (2 * STEP_M), (ahead_x[1] - behind_x[1]) / (2 * STEP_M)
    uy, vy = (ahead_y[0] - behind_y[0]) / (2 * STEP_M), (ahead_y[1] - behind_y[1]) / (2 * STEP_M)
    det = ux * vy - uy * vx
    if not abs(det) > 0.0:
        return np.nan, np.nan
    return (vy * du - uy * dv) / det, (ux * dv - vx * du) / det


@compiled
def outline_of(lens: LensNumbers, T_cb: Table, body: Table, at: Vec3) -> Table:
    """Return the hull of a body's pixels with its foot at a place; empty where a point of it is not seen."""
    pixels = np.empty((body.shape[0], 2))
    for i in range(body.shape[0]):
        pixels[i, 0], pixels[i, 1] = pixel_of(
            lens, T_cb, body[i, 0] + at[0], body[i, 1] + at[1], body[i, 2] + at[2]
        )  # fmt: skip
        if not np.isfinite(pixels[i, 0]):
            return pixels[:0].copy()
    return hull_of(pixels)


@compiled
def fit_body(
    lens: LensNumbers, T_cb: Table, body: Table, start: Vec3, seen: Bytes2, free: Bytes2, left: float, upper: float
) -> tuple[bool, float, float, float, float]:
    """Move a body on its plane until its middle in the picture is what is seen of it.

    Args:
        lens: the lens.
        T_cb: base frame to camera frame.
        body: points whose hull the body is, about its foot.  (n, 3) m
        start: where to begin, its foot.
        seen: 1 where the picture has the body's colour.  (h, w)
        free: 1 where nothing known stands before what is seen.  (h, w)
        left: column of the picture that both begin at.
        upper: row that both begin at.

    Returns:
        Whether anything of it is left to see; x and y of its foot; the area of model and picture both over that of
        either, where it is free; the share of the model that is.
    """
    x, y, z = start
    middle = z + body[:, 2].max() / 2.0
    is_found, best_x, best_y, overlap, visible = False, x, y, 0.0, 0.0
    for _ in range(N_STEPS):
        outline = outline_of(lens, T_cb, body, (x, y, z))
        if outline.shape[0] == 0:
            break
        n_whole, n_model, n_seen, n_both, model_u, model_v, seen_u, seen_v = compared(outline, seen, free, left, upper)
        if n_model == 0 or n_seen == 0:
            break
        is_found, best_x, best_y = True, x, y
        overlap, visible = n_both / (n_model + n_seen - n_both), n_model / n_whole
        # Of a body that is cut off by what stands before it, the middle moves by less than the body.
        gain = max(visible, LEAST_GAIN)
        du, dv = (seen_u / n_seen - model_u / n_model) / gain, (seen_v / n_seen - model_v / n_model) / gain
        if max(abs(du), abs(dv)) < STILL_PX:
            break
        dx, dy = moved_by(lens, T_cb, (x, y, middle), du, dv)
        x, y = x + dx, y + dy
    return is_found, best_x, best_y, overlap, visible


@compiled
def on_plane(lens: LensNumbers, T_cb: Table, u: float, v: float, start: Vec3) -> tuple[float, float]:
    """Return where a pixel's ray meets the plane of a start's height, by Newton's steps from there; nan if it fails."""
    x, y, z = start
    for _ in range(N_NEWTON):
        at = pixel_of(lens, T_cb, x, y, z)
        du, dv = u - at[0], v - at[1]
        dx, dy = moved_by(lens, T_cb, (x, y, z), du, dv)
        x, y = x + dx, y + dy
        if abs(du) + abs(dv) < 1e-6:
            return x, y
    return np.nan, np.nan
