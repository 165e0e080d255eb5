"""A scenario's table painted face by face: pictures without a renderer, by OpenCV's own projection."""

import cv2
import numpy as np

from config.loader import resolve
from perception.calibration.camera_file import CameraFile, ExtrinsicsRecord
from perception.calibration.poses import inverse, pose_of
from perception.detection.regions import Region
from perception.detection.shapes import CIRCLE, cap_points, lying_points, standing_points
from perception.detection.solids import box_solids, corners
from robot.frames import frame_of
from tests.support.boards import LENS, known_camera, matrices

SCENARIO = resolve().scenario
GLOW = 0.55
FINER = 3
BASE_RGB = (0.1, 0.1, 0.11)
FACES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))


def placed_camera(eye=(0.98, 0.04, 1.16), target=(0.435, 0.0, 0.0)):
    """A camera's file that says exactly where it stands."""
    ahead = np.subtract(target, eye)
    right = np.cross(ahead, [0, 0, 1])
    T = np.eye(4)
    T[:3, :3] = np.column_stack([v / np.linalg.norm(v) for v in (right, np.cross(ahead, right), ahead)])
    T[:3, 3] = eye
    record = ExtrinsicsRecord(
        date="2026-01-01", method="table", pose=pose_of(T), rms_px=0.1, touch_rms_mm=0.1, expected_mm=0.1,
        points_m=(), views=(),
    )  # fmt: skip
    known = known_camera(LENS)
    return CameraFile(
        name=known.name, serial=known.serial, board=known.board, lens=known.lens, intrinsics=known.intrinsics,
        extrinsics=record,
    ), T  # fmt: skip


def finer(pixels):
    """Pixels on the canvas, which is finer: OpenCV fills every pixel that an edge touches."""
    return FINER * pixels + (FINER - 1) / 2


CAMERA, T_BC = placed_camera()


def seen_at(points):
    T = inverse(T_BC)
    matrix, bent = matrices(LENS)
    return cv2.projectPoints(
        np.asarray(points, dtype=float), cv2.Rodrigues(T[:3, :3])[0], T[:3, 3], matrix, bent
    )[0].reshape(-1, 2)  # fmt: skip


class Painting:
    """One table: what is where, and its picture."""

    def __init__(self, *, light=(1.0, 1.0, 1.0), noise=1.0, seed=0):
        self._canvas = np.full((FINER * LENS.height_px, FINER * LENS.width_px, 3), 90.0)
        self._light, self._noise, self._rng = np.array(light), noise, np.random.default_rng(seed)
        table = SCENARIO.table
        (x, y), (a, b) = table.centre_m, np.array(table.size_m) / 2
        self.polygon([[x - a, y - b, 0], [x + a, y - b, 0], [x + a, y + b, 0], [x - a, y + b, 0]], table.colour)

    def polygon(self, points, rgb, shade=1.0):
        corners_px = np.round(finer(seen_at(points)) * 16).astype(np.int32)
        colour = 230.0 * np.array(rgb) * shade
        cv2.fillPoly(self._canvas, [corners_px], colour.tolist(), lineType=8, shift=4)

    def hull(self, points, rgb, shade=1.0):
        outline = cv2.convexHull(finer(seen_at(points)).astype(np.float32)).reshape(-1, 2)
        cv2.fillConvexPoly(
            self._canvas, np.round(outline * 16).astype(np.int32), (230.0 * np.array(rgb) * shade).tolist(), 8, 4
        )

    def box(self, box, at, *, is_open, inside=None):
        """Walls and leaves from the farthest face to the nearest; `inside` is painted before what stands before it."""
        angle = box.lid.open_angle_rad if is_open else 0.0
        faces = []
        for number, solid in enumerate(box_solids(box, lid_rad=angle)):
            points = corners(solid) + at
            for face in FACES:
                quad = points[list(face)]
                normal = np.cross(quad[1] - quad[0], quad[3] - quad[0])
                outward = normal * np.sign(normal @ (quad.mean(axis=0) - points.mean(axis=0)))
                if outward @ (T_BC[:3, 3] - quad[0]) > 0:
                    shade = 0.5 + 0.45 * abs(outward[2]) / np.linalg.norm(outward)
                    shade *= 1.0 if number < 4 else 0.86
                    faces.append((np.linalg.norm(quad.mean(axis=0) - T_BC[:3, 3]), quad, shade))
        (lx, ly) = np.array(box.inner_m) / 2
        self.polygon(np.array([[-lx, -ly, 0], [lx, -ly, 0], [lx, ly, 0], [-lx, ly, 0]]) + at, box.colour, 0.6)
        faces.sort(key=lambda face: -face[0])
        middle = np.linalg.norm(at + np.array([0, 0, 0.03]) - T_BC[:3, 3])
        for far, quad, shade in faces:
            if inside is not None and far < middle:
                inside()
                inside = None
            self.polygon(quad, box.colour, shade)

    def button(self, button, at, *, is_lit):
        radius = button.diameter_m / 2
        foot = button.height_m - button.travel_m - button.cap_m
        ring = np.column_stack([(radius + 0.006) * CIRCLE, np.zeros(len(CIRCLE))])
        self.hull(np.concatenate([ring, ring + np.array([0, 0, foot])]) + at, BASE_RGB)
        colour = np.array(button.colour)
        shown = colour + (1 - colour) * GLOW if is_lit else 0.8 * colour
        self.hull(cap_points(button) + at, shown)

    def standing(self, cylinder, at):
        self.hull(standing_points(cylinder) + at, cylinder.colour, 0.6)
        disc = np.column_stack([cylinder.diameter_m / 2 * CIRCLE, np.full(len(CIRCLE), cylinder.height_m)])
        self.hull(disc + at, cylinder.colour)

    def lying(self, cylinder, at, axis_rad):
        self.hull(lying_points(cylinder, axis_rad) + at, cylinder.colour, 0.85)

    def frame(self):
        drawn = cv2.resize(self._canvas, (LENS.width_px, LENS.height_px), interpolation=cv2.INTER_AREA)
        fine = cv2.GaussianBlur(drawn, (0, 0), 0.6) * self._light
        noisy = fine + self._rng.normal(0.0, self._noise, fine.shape)
        picture = np.clip(np.round(noisy), 0, 255).astype(np.uint8)
        return frame_of(picture, camera="side", sequence=0, stamp_ns=7, arrival_ns=9)


def nominal(rng=None):
    """Where things stand: their middles, or drawn within the scenario's spread."""
    place = {}
    for thing in (*SCENARIO.buttons, *SCENARIO.boxes):
        shift = np.zeros(2) if rng is None else rng.uniform(-1, 1, 2) * thing.spread_m
        place[thing.name] = np.array([*(np.array(thing.position_m) + shift), 0.0])
    for cylinder in SCENARIO.cylinders:
        shift = np.zeros(2) if rng is None else rng.uniform(-1, 1, 2) * cylinder.spread_m
        place[cylinder.name] = place[cylinder.inside] + np.array([*shift, 0.0])
    return place


def painted(place, *, lamps_on=(), lids_open=(), lying=None, **light):
    """The whole table; `lying` tells the axis of a cylinder that lies, those not in a box stand on the table."""
    picture, lying = Painting(**light), lying or {}
    order = sorted((*SCENARIO.buttons, *SCENARIO.boxes), key=lambda t: place[t.name][0])
    inside = {}
    for cylinder in SCENARIO.cylinders:
        at = place[cylinder.name]

        def paint(cylinder=cylinder, at=at):
            if cylinder.name in lying:
                picture.lying(cylinder, at, lying[cylinder.name])
            else:
                picture.standing(cylinder, at)

        home = next(
            (b.name for b in SCENARIO.boxes if (abs(at - place[b.name])[:2] < np.array(b.inner_m) / 2).all()), None
        )
        if home is None:
            paint()
        else:
            inside[home] = paint
    for thing in order:
        if thing in SCENARIO.buttons:
            picture.button(thing, place[thing.name], is_lit=thing.name in lamps_on)
        else:
            is_open = thing.name in lids_open
            picture.box(thing, place[thing.name], is_open=is_open, inside=inside.get(thing.name) if is_open else None)
    return picture.frame()


def guided_sample():
    """Two pictures and rough regions on them, as a person would draw."""
    place = nominal()
    names = [b.name for b in SCENARIO.boxes]
    frames = {
        "off": painted(place, lids_open=names, seed=11),
        "on": painted(place, lamps_on=[b.name for b in SCENARIO.buttons], seed=12),
    }
    regions = []

    def name(image, thing, points, state=""):
        polygon = tuple((float(u), float(v)) for u, v in seen_at(points))
        regions.append(Region(image=image, name=thing, state=state, polygon_px=polygon))

    flat = np.column_stack([CIRCLE[::4], np.zeros(10)])
    for button in SCENARIO.buttons:
        disc = 0.042 * flat + place[button.name] + np.array([0, 0, button.height_m])
        name("off", button.name, disc, "off")
        name("on", button.name, disc, "on")
        foot = np.array([[0.05, -0.02, 0.01], [0.05, 0.02, 0.01], [0.052, 0.02, 0.02], [0.052, -0.02, 0.02]])
        name("on", "base", foot + place[button.name])
    for cylinder in SCENARIO.cylinders:
        name("off", cylinder.name, 0.018 * flat + place[cylinder.name] + np.array([0, 0, cylinder.height_m]))
        front = np.array([[0.022, -0.008, 0.04], [0.022, 0.008, 0.04], [0.022, 0.008, 0.055], [0.022, -0.008, 0.055]])
        name("off", cylinder.name, front + place[cylinder.name])
    for box in SCENARIO.boxes:
        strip = np.array([[-0.05, 0.06, 0], [0.03, 0.06, 0], [0.03, 0.08, 0], [-0.05, 0.08, 0]])
        name("off", box.name, strip + place[box.name])
        name("on", box.name, strip + place[box.name] + np.array([0.0, -0.06, 0.092]))
    name("off", "table", [[0.74, -0.3, 0], [0.74, 0.3, 0], [0.8, 0.3, 0], [0.8, -0.3, 0]])
    return frames, regions
