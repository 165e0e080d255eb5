"""Each limit weakened alone by 5 %: the stack is given the weaker one, the monitor keeps the true one and must tell.

A limit that something tighter hides (the arm's own file, another limit) would never be reached. So each is first made
the one that binds, for stack and monitor alike, and shown to hold like that; only then it is weakened for the stack.
Time and distance of a stop no part of the stack keeps but the arm's own brake: they are set to the longest that came of
it, and the brake is weakened.
"""

from collections.abc import Iterator

import msgspec

from config.limits import Profile
from config.perturbation import Perturbation
from config.resolved import Resolved
from robot.teleop.battery import FAMILIES, Battery
from sim_twin.checking.check import FULL_STREAMS
from sim_twin.checking.ring import Ring
from sim_twin.checking.weakenings import BY, Mutation
from sim_twin.perturb import NOMINAL
from sim_twin.readings import Reading

__all__ = ["Outcome", "try_mutation"]

WEAKER_BRAKE = Perturbation(name="brake_weaker", braking_factor=1.0 / BY)
replace = msgspec.structs.replace


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """What came of one mutation."""

    limit: str
    true_margin_share: float
    """The least margin with the stack as it is."""
    weakened_margin_share: float
    is_held: bool
    """Nothing was broken with the stack as it is."""
    is_caught: bool
    family: str = ""
    """Of the stream that told it."""
    number: int = -1


def try_mutation(
    resolved: Resolved, mutation: Mutation, *, seed: int, n_streams: int | None = None, n_commands: int = 334
) -> Outcome:
    """Run the same streams with the limit as it is and weakened, until one tells.

    Args:
        resolved: rig and the profile to start from.
        mutation: which limit.
        seed: of the streams.
        n_streams: at most so many of them; the mutation's own number where absent.
        n_commands: of each.
    """
    resolved, n_streams = replace(resolved, arm=mutation.refit(resolved.arm)), n_streams or mutation.n_streams
    true = mutation.tighten(resolved.profile)
    ring = Ring(_holding(resolved, true), NOMINAL, true, n_commands=n_commands)
    try:
        held = list(_runs(ring, mutation, seed, n_streams))
    finally:
        ring.close()
    least = min((r.share for _, _, r in held), default=1.0)
    is_held = not any(r.is_broken for _, _, r in held)
    if mutation.fit is not None and held:
        true, least = mutation.fit(true, max(r.value for _, _, r in held)), 0.0
    ring = _weaker(resolved, mutation, true, n_commands)
    weakened, caught = 1.0, None
    try:
        for family, number, reading in _runs(ring, mutation, seed, n_streams):
            weakened = min(weakened, reading.share)
            if reading.is_broken:
                caught = (family, number)
                break
    finally:
        ring.close()
    family, number = caught or ("", -1)
    return Outcome(
        limit=mutation.name, true_margin_share=least, weakened_margin_share=weakened, is_held=is_held,
        is_caught=is_held and caught is not None, family=family, number=number,
    )  # fmt: skip


def _weaker(resolved: Resolved, mutation: Mutation, true: Profile, n_commands: int) -> Ring:
    """Return the stack with the limit weakened, or the plant with a weaker brake, judged by the true limit."""
    if mutation.weaken is None:
        return Ring(_holding(resolved, true), WEAKER_BRAKE, true, n_commands=n_commands)
    return Ring(_holding(resolved, mutation.weaken(true)), NOMINAL, true, n_commands=n_commands)


def _runs(ring: Ring, mutation: Mutation, seed: int, n: int) -> Iterator[tuple[str, int, Reading]]:
    """Run streams of the mutation's families in turn; yield what they are and each of its readings."""
    battery = Battery(seed=seed, n_streams=FULL_STREAMS, n_plants=1)
    for number in range(n):
        family = mutation.families[number % len(mutation.families)]
        came = ring.run(
            lambda look, arena, f=family, k=number: FAMILIES[f](look, arena, battery.rng(k)),
            number=number, family=family, seed=seed + number,
        )  # fmt: skip
        yield from ((family, number, r) for r in came.readings if r.limit in mutation.told_by)


def _holding(resolved: Resolved, profile: Profile) -> Resolved:
    """Return a config whose rig holds this profile."""
    profiles = tuple(profile if p.name == profile.name else p for p in resolved.limits.profiles)
    return replace(resolved, limits=replace(resolved.limits, profiles=profiles))
