"""Sessions into sessions: whole messages of one file, or of several, into a new one. The edge."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from robot.recording.chunks import Chunks
from robot.recording.errors import UnfitError
from robot.recording.lanes import Lane
from robot.recording.records import AttachedRecord, ChannelRecord, MetadataRecord, SchemaRecord
from robot.recording.sink import Sink
from robot.recording.topics import LANES

__all__ = ["Rewriting"]


class Rewriting:
    """A new file, made of records of others. Channels that are alike become one.

    Args:
        path: a file that is not there yet.
    """

    def __init__(self, path: Path) -> None:
        self._sink = Sink(path, may_wait=True)
        self._chunks = Chunks(lambda records, index, _n: self._put(lambda file: file.add_chunk(records, index)))
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[object, ...], tuple[int, Lane]] = {}
        self._attached: set[tuple[str, bytes]] = set()
        self._noted: list[tuple[str, dict[str, str]]] = []
        self._n: dict[int, int] = {}
        self.n_messages = 0

    def channel(self, channel: ChannelRecord, schema: SchemaRecord | None) -> int:
        """Return the number here of a channel there, written once."""
        kind = self._schema(schema)
        alike = (channel.topic, channel.encoding, kind, tuple(sorted(channel.metadata.items())))
        known = self._channels.get(alike)
        if known is None:
            number = len(self._channels) + 1
            known = self._channels[alike] = (number, LANES.get(channel.topic, Lane.DECISIONS))
            self._n[number] = 0
            self._put(
                lambda file: file.add_channel(channel._replace(id=number, schema=kind))
            )  # fmt: skip
        return known[0]

    def message(self, channel: int, topic: str, log_ns: int, publish_ns: int, payload: bytes) -> None:
        """Write a message; how many-th it is is counted anew."""
        self._chunks.add(LANES.get(topic, Lane.DECISIONS), channel, self._n[channel], log_ns, publish_ns, payload)
        self._n[channel] += 1
        self.n_messages += 1

    def attach(self, attached: AttachedRecord) -> None:
        """Write an attached file, unless the same is there."""
        if (attached.name, attached.content) not in self._attached:
            self._attached.add((attached.name, attached.content))
            self._put(lambda file: file.add_attachment(attached))

    def note(self, metadata: MetadataRecord) -> None:
        """Write a table of texts, unless the same is there."""
        if (metadata.name, metadata.values) not in self._noted:
            self._noted.append((metadata.name, metadata.values))
            self._put(lambda file: file.add_metadata(metadata))

    def close(self) -> None:
        """Finish the file.

        Raises:
            UnfitError: the disk is full, or gone.
        """
        self._chunks.flush()
        self._sink.close()
        if self._sink.why_lost is not None:
            raise UnfitError(self._sink.why_lost)

    def _schema(self, schema: SchemaRecord | None) -> int:
        if schema is None:
            return 0
        alike = (schema.name, schema.encoding, schema.definition)
        number = self._schemas.get(alike)
        if number is None:
            number = self._schemas[alike] = len(self._schemas) + 1
            self._put(lambda file: file.add_schema(schema._replace(id=number)))
        return number

    def _put(self, job: Callable[[Any], object]) -> None:
        self._sink.put_surely(job)
