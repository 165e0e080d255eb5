"""One root seed a run; every consumer and every reset gets its own, by name. Pure."""

import hashlib

import numpy as np

__all__ = ["evaluation_seed", "named_generator", "reset_seed"]


def named_generator(root_seed: int, name: str) -> np.random.Generator:
    """Return the generator of one consumer; adding a consumer changes nobody else's numbers."""
    return np.random.default_rng(np.random.SeedSequence(root_seed, spawn_key=_words(name)))


def reset_seed(root_seed: int, epoch: int) -> int:
    """Return the seed that lays the table out for a learning epoch, in [0, 2^63)."""
    return _draw(root_seed, (*_words("reset"), epoch))


def evaluation_seed(root_seed: int, *, epoch: int, rules_epoch: int, goal: int, test: int) -> int:
    """Return the seed of one test epoch of one evaluation, in [0, 2^63); never one that was learnt on."""
    return _draw(root_seed, (*_words("test"), epoch, rules_epoch, goal, test))


def _words(name: str) -> tuple[int, ...]:
    """A name as four 32-bit words of its digest."""
    digest = hashlib.sha256(name.encode()).digest()
    return tuple(int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4))


def _draw(root_seed: int, spawn_key: tuple[int, ...]) -> int:
    state = np.random.SeedSequence(root_seed, spawn_key=spawn_key).generate_state(1, np.uint64)
    return int(state[0] >> np.uint64(1))
