"""What crosses the bus of an arm's every tick: some of them at a time, as the process that ticks wrote them."""

from collections.abc import Sequence

import msgspec

from robot.bus.codec import schema_hash
from robot.bus.errors import MalformedError, SchemaError
from robot.tick_ring import Tick

__all__ = ["TickBatch", "pack_ticks", "unpack_ticks"]


class TickBatch(msgspec.Struct, frozen=True, kw_only=True):
    """Ticks that followed one another."""

    layout: str
    """Of a tick: a reader of another version must not take one thing for another."""
    n_missed: int
    """Ticks so far, since the process began, that nobody read in time."""
    ticks: bytes


def pack_ticks(raws: Sequence[bytes], *, n_missed: int) -> TickBatch:
    """Return ticks as they travel.

    Args:
        raws: each as robot.tick_ring has it.
        n_missed: how many there were besides.
    """
    packed = msgspec.msgpack.encode([msgspec.Raw(raw) for raw in raws])
    return TickBatch(layout=_layout(), n_missed=n_missed, ticks=packed)


def unpack_ticks(batch: TickBatch) -> list[Tick]:
    """Return the ticks that travelled.

    Raises:
        SchemaError: they were written by another version.
        MalformedError: they are none.
    """
    if batch.layout != _layout():
        raise SchemaError(f"ticks: expected layout {_layout()}, came {batch.layout!r}; do both run the same version?")
    try:
        return _decode(batch.ticks)
    except (msgspec.MsgspecError, RecursionError, ValueError) as error:
        raise MalformedError(f"ticks: expected a batch of them: {error}") from error


def _layout() -> str:
    return schema_hash(Tick).hex()


_decode = msgspec.msgpack.Decoder(list[Tick]).decode
