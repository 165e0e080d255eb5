"""What touched what, how hard and how fast, against the pairs that a profile allows."""

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from config.limits import AllowedContact, Profile, Touched
from sim_twin.readings import Reading
from sim_twin.recorder import Course, PartKind, Touch

__all__ = ["allowed_pairs", "contact_readings", "pressing_n"]

_THINGS = {
    Touched.OBJECT: (PartKind.OBJECT,),
    Touched.BUTTON: (PartKind.BUTTON,),
    Touched.BOX: (PartKind.BOX, PartKind.LID),
    Touched.TABLE: (PartKind.TABLE,),
}
NEW_S = 0.05
"""A pair that has not touched for so long meets anew."""


def allowed_pairs(profile: Profile) -> dict[tuple[PartKind, PartKind], AllowedContact]:
    """Return which part may touch which, with the bounds; what is not among them may not touch."""
    return {(PartKind(pair.part.value), thing): pair for pair in profile.contacts for thing in _THINGS[pair.thing]}


def contact_readings(course: Course, profile: Profile) -> Iterator[Reading]:
    """Read pairs, forces of each pair and of all together, and speeds at which parts met."""
    allowed = allowed_pairs(profile)
    yield _pairs(course, allowed)
    by_pair: dict[str, list[tuple[Touch, AllowedContact]]] = {f"{p.part}-{p.thing}": [] for p in profile.contacts}
    for touch in course.touches:
        pair = allowed.get((touch.own, touch.other))
        if pair is not None:
            by_pair[f"{pair.part}-{pair.thing}"].append((touch, pair))
    for name, touches in by_pair.items():
        if not touches:
            continue
        worst, pair = max(touches, key=lambda entry: entry[0].force_n)
        share = 1.0 - worst.force_n / pair.force_n
        at_s = worst.step * course.physics_s
        yield Reading(limit=f"force:{name}", share=share, value=worst.force_n, at_s=at_s, detail=worst.other_name)
        yield _meeting(course, name, [t for t, _ in touches], pair)
    yield from _whole(course, profile)


def pressing_n(course: Course) -> NDArray[np.float64]:
    """Return the force on the whole arm, friction with it: what presses on it from all sides or pushes it one way.

    The greater of the two: a squeeze moves nothing, and what rubs along presses little.  () -> (steps,)
    """
    by_step = np.zeros((course.n_steps, 4))
    for touch in course.touches:
        by_step[touch.step] += (touch.force_n, *touch.vector_n)
    return np.maximum(by_step[:, 0], np.linalg.norm(by_step[:, 1:], axis=1))


def _pairs(course: Course, allowed: dict[tuple[PartKind, PartKind], AllowedContact]) -> Reading:
    """Read whether anything touched that may not: 0 where nothing did, else minus the force in hundreds of newtons."""
    wrong = [t for t in course.touches if (t.own, t.other) not in allowed]
    if not wrong:
        return Reading(limit="contact_pair", share=1.0, value=0.0)
    worst = max(wrong, key=lambda t: t.force_n)
    return Reading(
        limit="contact_pair", share=-0.01 - worst.force_n / 100.0, value=worst.force_n,
        at_s=worst.step * course.physics_s, detail=f"{worst.own} on {worst.other_name}",
    )  # fmt: skip


def _meeting(course: Course, name: str, touches: list[Touch], pair: AllowedContact) -> Reading:
    """Read the greatest speed of the tool when the pair met, one step before the first of each contact."""
    apart = round(NEW_S / course.physics_s)
    last: dict[str, int] = {}
    fastest, at = 0.0, 0
    for touch in touches:
        is_new = touch.step - last.get(touch.other_name, -apart - 1) > apart
        last[touch.other_name] = touch.step
        speed = float(course.speed_m_s[max(touch.step - 1, 0), 0])
        if is_new and speed > fastest:
            fastest, at = speed, touch.step
    return Reading(
        limit=f"meeting_speed:{name}", share=1.0 - fastest / pair.speed_m_s, value=fastest, at_s=at * course.physics_s
    )


def _whole(course: Course, profile: Profile) -> Iterator[Reading]:
    """Read the force on the whole arm: the greatest mean over one tick, and the greatest that outlasts one."""
    if not course.touches:
        return
    whole = pressing_n(course)
    n_ticks, n = -(-course.n_steps // course.n_substeps), course.n_substeps
    by_tick = (np.pad(whole, (0, n_ticks * n - len(whole))).reshape(n_ticks, n).sum(axis=1) / n).tolist()
    force, tick_s = profile.contact_force, course.physics_s * course.n_substeps
    blow = max(range(n_ticks), key=by_tick.__getitem__)
    yield Reading(limit="blow", share=1.0 - by_tick[blow] / force.blow_n, value=by_tick[blow], at_s=blow * tick_s)
    lasting = [min(pair) for pair in itertools.pairwise(by_tick)] or [0.0]
    steady = max(range(len(lasting)), key=lasting.__getitem__)
    yield Reading(
        limit="steady_force", share=1.0 - lasting[steady] / force.steady_n, value=lasting[steady], at_s=steady * tick_s
    )
