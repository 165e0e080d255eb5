"""The faults' door: one JSON object a line in, one out, on a loopback port that no robot has."""

import msgspec

from sim_twin.controller.faults import FaultError, Faults
from sim_twin.controller.wire.lines import LineReader
from sim_twin.controller.wire.peer import Peer

__all__ = ["CONTROL", "ControlPort"]

CONTROL = 30990
_N_LINE_BYTES = 65_536


class ControlPort:
    """Answers `{"fault": "delay", "ms": 20}`; a `Service` of the reactor.

    The answer is what the fault tells, or `{"error": "..."}`.
    """

    def __init__(self, faults: Faults) -> None:
        self._faults = faults
        self._lines: dict[Peer, LineReader] = {}

    def opened(self, peer: Peer) -> None:
        """Expect a line."""
        self._lines[peer] = LineReader(_N_LINE_BYTES)

    def received(self, peer: Peer, chunk: bytes) -> None:
        """Answer the lines that are complete."""
        reader = self._lines[peer]
        for line in reader.feed(chunk):
            peer.reply(msgspec.json.encode(self._answer(line)) + b"\n")
        if reader.is_overlong:
            peer.close()

    def closed(self, peer: Peer) -> None:
        """Forget the client; its faults go on."""
        del self._lines[peer]

    def _answer(self, line: bytes) -> dict[str, object]:
        try:
            asked = msgspec.json.decode(line, type=dict[str, object])
            return self._faults.apply(str(asked.pop("fault", "")), **asked)
        except RecursionError:
            return {"error": "expected one flat JSON object, got one nested too deep"}
        except (msgspec.DecodeError, FaultError) as error:
            return {"error": str(error)}
