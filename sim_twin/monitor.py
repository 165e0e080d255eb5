"""An independent monitor: what a profile of limits allows against what the physics did.

It takes the limits from the file and everything else from the twin's own truth: joints, velocities of points, contacts
and distances between bodies as MuJoCo has them. It shares no line of code with motion, gate or their checks, so that a
mistake there cannot hide itself here.

Every limit gets a reading: the least margin over the course as a share of the limit, negative where it was broken.
What a reading may fall below zero by is the plant's part of the story and is in `Allowances`, with its reason.
"""

from collections.abc import Iterator, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from config.limits import ArmPart, GripLimits, JointLimit, KeepOut, Plane, Profile
from sim_twin.allowances import DROOP_M_PER_KG, Allowances
from sim_twin.clearance import Clearances, own_pairs, scene_pairs
from sim_twin.contacts import allowed_pairs, contact_readings, pressing_n
from sim_twin.plant import TwinWorld
from sim_twin.postures import Posed, Postures
from sim_twin.readings import Margin, Reading
from sim_twin.recorder import Course, PartKind
from sim_twin.scales import keep_out_scale_m, plane_scale_m

__all__ = ["Monitor"]

Array = NDArray[np.float64]
_POINT = {ArmPart.TCP: 0, ArmPart.FLANGE: 1, ArmPart.ELBOW: 2}
CALM_S = 0.15
"""So long after a contact the joints' acceleration is still the contact's doing: the servo swings it off."""
REST_M_S = 0.005
"""Fingers that were stopped while they pressed creep over what they stand on at a few millimetres a second."""
RINGING_S = 0.1
SOFT_SHARE = 0.1
"""Share of its greatest speed that a joint in its soft margin has left towards its very end."""
BEND_M_PER_N = DROOP_M_PER_KG / 9.81
"""What presses on the tool bends the arm about its servos' stiffness, as a load does."""
HARD_N = 60.0
"""A hand that holds something light presses on it with less."""


class Monitor:
    """Judges courses of one world against one profile."""

    def __init__(self, world: TwinWorld, profile: Profile, allowances: Allowances) -> None:
        self._profile, self._allow, self._world = profile, allowances, world
        self._postures = Postures(world)
        self._own = Clearances(world, own_pairs(world))
        self._scene = Clearances(world, scene_pairs(world, allowed_pairs(profile)))

    def judge(self, course: Course) -> tuple[Reading, ...]:
        """Return a reading of every limit, in the order of the profile."""
        if course.n_steps == 0:
            return ()
        return tuple(
            msgspec.structs.replace(reading, is_broken=bool(reading.share < -self._allow.of(reading.limit)))
            for reading in self._readings(course)
        )

    def margins(self, course: Course) -> Iterator[Margin]:
        """Return the margin of each limit that has one at every instant, as shares over the course."""
        yield from self._margins(course, self._postures.along(course))

    def _margins(self, course: Course, posed: Posed) -> Iterator[Margin]:
        yield from self._joints(course)
        yield from self._set_points(course, posed)
        yield from self._speeds(course)
        yield from self._space(course)
        yield from self._grip(course)

    def _readings(self, course: Course) -> Iterator[Reading]:
        posed = self._postures.along(course)
        yield from (margin.worst() for margin in self._margins(course, posed))
        yield from contact_readings(course, self._profile)
        yield from _stops(course, self._profile)
        clearances, n = self._profile.clearances, course.n_substeps
        bend_m = BEND_M_PER_N * pressing_n(course)[n - 1 :: n]
        unasked_m = np.where(_near(course, course.stopping)[n - 1 :: n], np.inf, 0.0)
        for name, of, least_m in (
            ("self_clearance", self._own, clearances.self_m), ("scene_clearance", self._scene, clearances.scene_m)
        ):  # fmt: skip
            yield of.reading(name, course, course.placed, least_m, spare_m=bend_m)
            yield of.reading(f"command_{name}", course, posed.placed, least_m, spare_m=unasked_m)

    def _joints(self, course: Course) -> Iterator[Margin]:
        joints = self._profile.joints
        low, high = (np.array([j.range_rad[i] for j in joints]) for i in (0, 1))
        half = (high - low) / 2.0
        yield Margin(
            "joint_range", 1.0 - np.abs(course.q_rad - (low + high) / 2.0) / half, course.q_rad, course.physics_s
        )
        speed = np.abs(course.qd_rad_s)
        yield Margin("joint_speed", 1.0 - speed / [j.speed_rad_s for j in joints], speed, course.physics_s)
        rate, is_gain = _accelerations(course)
        if len(rate):
            most = np.where(
                is_gain, [j.acceleration_rad_s2 for j in joints], [j.stop_acceleration_rad_s2 for j in joints]
            )
            yield Margin("joint_acceleration", 1.0 - rate / most, rate, course.physics_s)

    def _set_points(self, course: Course, posed: Posed) -> Iterator[Margin]:
        """Read what reached the drives: its differences over ticks, exact where the joints themselves lag and swing.

        While the plant stops by itself, is laid out anew, or is in contact, where a set-point falls back to the arm,
        differences say nothing of a limit.
        """
        joints, tick_s = self._profile.joints, course.physics_s * course.n_substeps
        odd = _near(course, course.stopping | _pressed(course))[:: course.n_substeps][: len(course.set_point_rad)]
        if len(course.set_point_rad) < 2:
            return
        speed = np.diff(course.set_point_rad, axis=0) / tick_s
        rate = np.diff(speed, axis=0) / tick_s
        jerk = np.diff(rate, axis=0) / tick_s
        for name, came, most in (
            ("command_speed", np.abs(speed), [j.speed_rad_s for j in joints]),
            ("command_acceleration", _gained(speed) / tick_s, [j.acceleration_rad_s2 for j in joints]),
            ("command_stop_acceleration", np.abs(rate), [j.stop_acceleration_rad_s2 for j in joints]),
            ("command_jerk", _grown(speed, rate) / tick_s, [j.jerk_rad_s3 for j in joints]),
            ("command_stop_jerk", np.abs(jerk), [j.stop_jerk_rad_s3 for j in joints]),
        ):
            if len(came) == 0:
                continue
            judged = np.where(odd[len(odd) - len(came) :, None], 0.0, came)
            yield Margin(name, 1.0 - judged / most, judged, tick_s)
        toward, most = _towards_ends(course.set_point_rad, joints)
        judged = np.where(odd[len(odd) - len(toward) :, None], 0.0, toward / tick_s)
        yield Margin("command_soft_margin", 1.0 - judged / most, judged, tick_s)
        moved = posed.speeds(tick_s)
        moved = np.where(odd[len(odd) - len(moved) :, None], 0.0, moved)
        for i, (name, most) in enumerate(_point_speeds(self._profile)):
            yield Margin(f"command_{name}_speed", 1.0 - moved[:, i] / most, moved[:, i], tick_s)

    def _speeds(self, course: Course) -> Iterator[Margin]:
        for i, (name, most) in enumerate(_point_speeds(self._profile)):
            came = course.speed_m_s[:, i]
            yield Margin(f"{name}_speed", 1.0 - came / most, came, course.physics_s)

    def _space(self, course: Course) -> Iterator[Margin]:
        space = self._profile.workspace
        for box in space.boxes:
            middle, half = _middle(box.low_m, box.high_m), _half(box.low_m, box.high_m)
            inside = np.stack([1.0 - np.abs(_at(course, p) - middle) / half for p in box.parts], axis=1)
            yield Margin(f"box:{box.name}", inside, inside, course.physics_s)
        for plane in space.planes:
            height = np.stack([_over(plane, _at(course, p)) for p in plane.parts], axis=1)
            yield Margin(f"plane:{plane.name}", height / plane_scale_m(plane), height, course.physics_s)
        for keep in space.keep_outs:
            away = np.stack([_outside(keep, _at(course, p)) for p in keep.parts], axis=1)
            yield Margin(f"keep_out:{keep.name}", away / keep_out_scale_m(keep), away, course.physics_s)
        tilt = np.arccos(np.clip(-course.approach[:, 2], -1.0, 1.0))
        yield Margin("tool_cone", 1.0 - tilt / space.tool_cone_rad, tilt, course.physics_s)

    def _grip(self, course: Course) -> Iterator[Margin]:
        grip = self._profile.grip
        yield Margin("grip_force", 1.0 - course.grip_force_n / grip.force_n[1], course.grip_force_n, course.physics_s)
        speed = _finger_speeds(course)
        if len(speed):
            yield Margin("grip_speed", 1.0 - speed / grip.speed_m_s[1], speed, course.physics_s)
        yield from _asked_of_hand(course, grip)
        low, high = grip.opening_m
        half = (high - low) / 2.0
        yield Margin(
            "grip_opening",
            1.0 - np.abs(course.opening_m - (low + high) / 2.0) / half,
            course.opening_m,
            course.physics_s,
        )


def _at(course: Course, part: ArmPart) -> Array:
    return course.position_m[:, _POINT[part]]


def _point_speeds(profile: Profile) -> tuple[tuple[str, float], ...]:
    speeds = profile.speeds
    return ("tcp", speeds.tcp_m_s), ("flange", speeds.flange_m_s), ("elbow", speeds.elbow_m_s)


def _middle(low: tuple[float, ...], high: tuple[float, ...]) -> Array:
    return np.add(low, high) / 2.0


def _half(low: tuple[float, ...], high: tuple[float, ...]) -> Array:
    return np.subtract(high, low) / 2.0


def _over(plane: Plane, at: Array) -> Array:
    """Return how far points are on the allowed side.  (n, 3) -> (n,)"""
    normal = np.array(plane.normal)
    return (at - np.array(plane.point_m)) @ (normal / np.linalg.norm(normal))


def _outside(keep: KeepOut, at: Array) -> Array:
    """Return how far points are outside a rounded box, negative inside.  (n, 3) -> (n,)"""
    past = np.abs(at - _middle(keep.low_m, keep.high_m)) - _half(keep.low_m, keep.high_m)
    return np.linalg.norm(np.maximum(past, 0.0), axis=1) + np.minimum(past.max(axis=1), 0.0) - keep.radius_m


def _gained(speed: Array) -> Array:
    """Return by how much each speed grew on the one before, after a turn all of it.  (n, 6) -> (n-1, 6)"""
    is_on = speed[1:] * speed[:-1] > 0.0
    return np.maximum(np.abs(speed[1:]) - np.where(is_on, np.abs(speed[:-1]), 0.0), 0.0)


def _grown(speed: Array, rate: Array) -> Array:
    """Return by how much each rate grew on the one before where a joint gathers speed without having turned.

    What let go of a brake counts from where it gathers speed again; 0 elsewhere.

    Args:
        speed: (n, 6)
        rate: (n-1, 6) from one speed to the next.

    Returns:
        (n-2, 6)
    """
    way = np.sign(rate[1:])
    is_on = (speed[2:] * way > 0.0) & (speed[1:-1] * way >= 0.0)
    return np.where(is_on, np.maximum((rate[1:] - way * np.maximum(rate[:-1] * way, 0.0)) * way, 0.0), 0.0)


def _accelerations(course: Course) -> tuple[Array, NDArray[np.bool_]]:
    """Return the change of speed over one tick of commands, per second, where nothing but the servo moves the arm.

    Set-points come once a tick and the servo follows each in a few steps of physics, so that the instant's acceleration
    ripples; a command has no say in less than a tick. In contact, and while the plant runs its own stop, other limits
    hold: forces, and distance and time of a stop. A drive that gives all its torque follows no law of a servo: a stair
    of a set-point asks for more than that from a light joint at speed, and for a step of physics the joint gathers what
    its torque over its inertia makes of it. What was asked of it is judged by the set-points all the same.

    Returns:
        (n, 6), zero where it is not judged, and whether speed was gained by it.
    """
    n = course.n_substeps
    if course.n_steps <= n:
        return np.empty((0, 6)), np.empty((0, 6), dtype=bool)
    now, then = course.qd_rad_s[n:], course.qd_rad_s[:-n]
    rate = np.abs(now - then) / (n * course.physics_s)
    odd = _near(course, course.stopping | _pressed(course))[n:, None] | _within(course.at_torque, 2 * n)[n:]
    return np.where(odd, 0.0, rate), now * (now - then) > 0.0


def _within(when: NDArray[np.bool_], n: int) -> NDArray[np.bool_]:
    """Return whether something was so in the last n steps, joint by joint.  (k, 6), () -> (k, 6)"""
    so_far = np.cumsum(np.concatenate([np.zeros((1, when.shape[1]), dtype=int), when]), axis=0)
    before = np.maximum(np.arange(1, len(when) + 1) - n, 0)
    return so_far[1:] - so_far[before] > 0


def _pressed(course: Course) -> NDArray[np.bool_]:
    """Return when the arm touched anything but what it holds lightly.  () -> (n,)"""
    pressed = np.zeros(course.n_steps, dtype=bool)
    pressed[[t.step for t in course.touches if t.other is not PartKind.OBJECT or t.force_n > HARD_N]] = True
    return pressed


def _towards_ends(set_point_rad: Array, joints: Sequence[JointLimit]) -> tuple[Array, Array]:
    """Return steps towards an end where they lead into its soft margin, 0 elsewhere, and what speeds may be there.

    In a margin as wide as m, a gap g before the end, a joint may go at S + (1 - S) g / m of its greatest speed, with S
    the share that is left at the end itself.  (n, 6) -> (n-1, 6), (n-1, 6)
    """
    step, at = np.diff(set_point_rad, axis=0), set_point_rad[1:]
    low, high = (np.array([j.range_rad[i] for j in joints]) for i in (0, 1))
    wide, speed = np.array([j.soft_margin_rad for j in joints]), np.array([j.speed_rad_s for j in joints])
    gap = np.where(step > 0.0, high - at, at - low)
    left = np.clip(gap / np.maximum(wide, 1e-12), 0.0, 1.0)
    return np.where(gap < wide, np.abs(step), 0.0), speed * (SOFT_SHARE + (1.0 - SOFT_SHARE) * left)


def _asked_of_hand(course: Course, grip: GripLimits) -> Iterator[Margin]:
    """Read what reached the hand's drive, against both ends of what it may be asked for: exact, like set-points."""
    tick_s = course.physics_s * course.n_substeps
    for i, (name, (low, high)) in enumerate((("force", grip.force_n), ("speed", grip.speed_m_s)), start=1):
        asked = course.hand_asked[:, i]
        share = np.minimum(1.0 - asked / high, asked / low - 1.0)
        yield Margin(f"command_grip_{name}", np.where(np.isnan(asked), 1.0, share), np.nan_to_num(asked), tick_s)


def _finger_speeds(course: Course) -> Array:
    """Return how fast the opening changed, over spans in which the fingers' own ringing about their ramp cancels.

    Fingers that touched something are moved by what they hold, and snap shut when they lose it: zero there.

    Returns:
        (n,)
    """
    n = round(RINGING_S / course.physics_s)
    touching = np.zeros(course.n_steps, dtype=bool)
    touching[[t.step for t in course.touches if t.own is PartKind.FINGERS]] = True
    touching |= course.stopping  # and a table that is laid out anew after a stop opens the hand at once
    speed = np.abs(course.opening_m[n:] - course.opening_m[:-n]) / RINGING_S
    return np.where(_near(course, touching)[n:], 0.0, speed)


def _near(course: Course, when: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return whether something was so at a step or a short while before it.  (n,) -> (n,)"""
    calm = round(CALM_S / course.physics_s) + course.n_substeps
    return np.convolve(when, np.ones(calm), mode="full")[: course.n_steps] > 0.0


def _stops(course: Course, profile: Profile) -> Iterator[Reading]:
    """Read how long and how far the plant's own stops were, each from its first step to rest."""
    if not course.stopping.any():
        return
    begins = np.flatnonzero(np.diff(np.concatenate([[False], course.stopping]).astype(np.int8)) == 1)
    longest, farthest = 0.0, 0.0
    for begin in begins.tolist():
        running = course.stopping[begin:]
        end = begin + (int(np.argmin(running)) if not running.all() else len(running))
        moving = np.flatnonzero(course.speed_m_s[begin:end].max(axis=1) > REST_M_S)
        last = int(moving[-1]) + 1 if len(moving) else 0
        longest = max(longest, last * course.physics_s)
        path = np.diff(course.position_m[begin : min(begin + last + 1, end), 0], axis=0)
        farthest = max(farthest, float(np.linalg.norm(path, axis=1).sum()))
    stopping, at_s = profile.stopping, float(begins[0]) * course.physics_s
    yield Reading(limit="stop_time", share=1.0 - longest / stopping.time_s, value=longest, at_s=at_s)
    yield Reading(limit="stop_distance", share=1.0 - farthest / stopping.distance_m, value=farthest, at_s=at_s)
