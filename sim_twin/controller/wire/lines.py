"""Newline framing, shared by the ports that talk in lines. Pure."""

__all__ = ["LineReader"]


class LineReader:
    """Cuts a byte stream into lines, wherever TCP has cut it before.

    Attributes:
        is_overlong: A line grew beyond the limit without an end; the rest of the stream is not read any more.
    """

    def __init__(self, n_line_bytes: int) -> None:
        self.is_overlong = False
        self._n_line_bytes = n_line_bytes
        self._unfinished = bytearray()

    def feed(self, chunk: bytes) -> list[bytes]:
        """Return the lines that are complete now, without their ends."""
        if self.is_overlong:
            return []
        self._unfinished += chunk
        lines: list[bytes] = []
        if b"\n" in chunk:
            *lines, rest = bytes(self._unfinished).split(b"\n")
            self._unfinished = bytearray(rest)
        self.is_overlong = len(self._unfinished) > self._n_line_bytes
        return [line.removesuffix(b"\r") for line in lines]
