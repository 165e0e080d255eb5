"""The battery, or a seeded part of it, against a rig's stack on nominal and perturbed twins, on all processors."""

from collections.abc import Callable, Iterator
from functools import lru_cache, partial

import msgspec
import numpy as np

from config.limits import Profile
from config.resolved import Resolved
from robot.teleop import Battery, Search
from robot.teleop.search import Candidates
from robot.teleop.wanted import Wanted
from sim_twin.as_seen import Beginning
from sim_twin.checking.ring import Ring, StreamResult
from sim_twin.checking.spread import spread
from sim_twin.perturb import PERTURBATIONS

__all__ = ["FULL_STREAMS", "N_COMMANDS", "Block", "Setup", "check_streams", "part_of", "rerun", "setup_of"]

FULL_STREAMS, N_COMMANDS = 3072, 334
PART = 10
BLOCK_STREAMS = 8


class Setup(msgspec.Struct, frozen=True, kw_only=True):
    """What every worker needs to know; two with the same are the same check."""

    resolved: Resolved
    """Rig, arm, scenario and the limits that the stack holds."""
    profile: Profile
    """The limits that the monitor holds."""
    seed: int
    n_streams: int = FULL_STREAMS
    n_commands: int = N_COMMANDS
    start: Beginning | None = None
    """Where arm and table are at each stream's beginning; drawn for each where None."""

    @property
    def battery(self) -> Battery:
        """The numbered streams."""
        return Battery(seed=self.seed, n_streams=self.n_streams, n_plants=len(PERTURBATIONS))


def setup_of(resolved: Resolved, wanted: Wanted, *, start: Beginning | None = None) -> Setup:
    """Return what is checked, by the options; `start` is where arm and table are at each stream's beginning."""
    return Setup(
        resolved=resolved,
        profile=resolved.profile,
        seed=wanted.seed,
        n_commands=wanted.n_commands or N_COMMANDS,
        start=start,
    )


class Block(msgspec.Struct, frozen=True, kw_only=True):
    """Streams that one worker runs one after another: stand-alone ones on one plant, or a search's."""

    plant: int
    numbers: tuple[int, ...] = ()
    search: Search | None = None
    target: str = ""
    """The limit that a search goes for; empty for whichever is nearest."""

    @property
    def streams(self) -> tuple[int, ...]:
        """Their numbers, a search's too."""
        search = self.search
        return self.numbers if search is None else tuple(range(search.first, search.first + search.n_streams))

    @property
    def n_streams(self) -> int:
        """How many."""
        return len(self.streams)


def part_of(setup: Setup, *, full: bool) -> tuple[Block, ...]:
    """Return all blocks of the battery, or a tenth of them drawn by the seed, every family and plant among them."""
    battery = setup.battery
    numbers = np.arange(battery.n_plain)
    searches = battery.searches()
    if not full:
        rng = np.random.default_rng([setup.seed, 1])
        numbers = np.sort(rng.permutation(numbers)[: -(-len(numbers) // PART)])
        searches = searches[::PART] if len(searches) > PART else searches[:1]
    by_plant: dict[int, list[int]] = {}
    for number in numbers.tolist():
        by_plant.setdefault(battery.place(number).plant, []).append(number)
    blocks = [
        Block(plant=plant, numbers=tuple(of[i : i + BLOCK_STREAMS]))
        for plant, of in sorted(by_plant.items())
        for i in range(0, len(of), BLOCK_STREAMS)
    ]
    goals = _goals(setup.profile)
    blocks += [Block(plant=s.plant, search=s, target=goals[s.target % len(goals)]) for s in searches]
    return tuple(blocks)


def _goals(profile: Profile) -> tuple[str, ...]:
    """Return the limits that searches go for, in turn."""
    space = profile.workspace
    return (
        "", "tcp_speed", "tool_cone", "scene_clearance", *(f"box:{b.name}" for b in space.boxes), "joint_speed",
        "elbow_speed", "joint_acceleration", *(f"plane:{p.name}" for p in space.planes), "flange_speed",
        *(f"keep_out:{k.name}" for k in space.keep_outs), "joint_range", "self_clearance",
    )  # fmt: skip


def check_streams(
    setup: Setup,
    blocks: tuple[Block, ...],
    *,
    n_workers: int,
    heard: Callable[[list[StreamResult]], None],
    look: Callable[[], object] = lambda: None,
) -> None:
    """Run blocks on so many processes, and tell of each block's results as it ends.

    Args:
        setup: what is checked.
        blocks: which streams.
        n_workers: how many processes; one is this one.
        heard: told of each block's results.
        look: called now and then; what it raises ends the check.

    Raises:
        KeyboardInterrupt: a person had enough; no worker is left behind.
    """
    spread(partial(run_block, msgspec.json.encode(setup)), blocks, n_workers=n_workers, heard=heard, look=look)


@lru_cache(maxsize=2 * len(PERTURBATIONS))
def _made(coded: bytes, plant: int) -> tuple[Setup, Ring]:
    setup = msgspec.json.decode(coded, type=Setup)
    ring = Ring(setup.resolved, PERTURBATIONS[plant], setup.profile, n_commands=setup.n_commands, start=setup.start)
    return setup, ring


def run_block(coded: bytes, block: Block) -> list[StreamResult]:
    """Run one block in this process."""
    setup, ring = _made(coded, block.plant)
    if block.search is not None:
        return list(_search(setup, ring, block))
    return [_alone(setup, ring, number) for number in block.numbers]


def _alone(setup: Setup, ring: Ring, number: int) -> StreamResult:
    battery = setup.battery
    return ring.run(
        lambda look, arena: battery.stream(number, look, arena),
        number=number, family=battery.place(number).family, seed=setup.seed * 1_000_003 + number,
    )  # fmt: skip


def _search(setup: Setup, ring: Ring, block: Block) -> Iterator[StreamResult]:
    search, battery = block.search, setup.battery
    assert search is not None, "asked before"
    candidates = Candidates(battery.rng(search.first))
    for number in range(search.first, search.first + search.n_streams):
        knots = candidates.propose()
        came = ring.run(
            lambda look, arena, knots=knots: battery.play(knots, look, arena),
            number=number, family=f"search {block.target}".strip(), seed=setup.seed * 1_000_003 + search.first,
        )  # fmt: skip
        candidates.learn(knots, _score(came, block.target))
        yield came


def _score(came: StreamResult, target: str) -> float:
    return min((r.share for r in came.readings if target in ("", r.limit)), default=1.0)


def rerun(setup: Setup, number: int) -> tuple[StreamResult, Ring]:
    """Run one stream again, those of its search before it where it has one, and return its ring with the course.

    Raises:
        ValueError: there is no such stream.
    """
    battery = setup.battery
    if not 0 <= number < battery.n_streams:
        raise ValueError(f"expected a stream from 0 to {battery.n_streams - 1}, came {number}")
    coded = msgspec.json.encode(setup)
    if number < battery.n_plain:
        _, ring = _made(coded, battery.place(number).plant)
        return _alone(setup, ring, number), ring
    block = next(
        b for b in part_of(setup, full=True) if b.search is not None and 0 <= number - b.search.first < b.n_streams
    )
    _, ring = _made(coded, block.plant)
    for came in _search(setup, ring, block):
        if came.number == number:
            return came, ring
    raise AssertionError("a search has every number of its block")
