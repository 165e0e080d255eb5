"""Passes Ethernet frames between two interfaces: late, not at all, twice or in another order. A process of its own.

Faults are of packets, below TCP: the kernels at both ends see them as they would those of a bad cable. Lines of JSON on
standard input set them.
"""

import array
import fcntl
import heapq
import json
import select
import socket
import struct
import sys
import time

import numpy as np

ETH_P_ALL = 3
SIOCETHTOOL = 0x8946
OFF = {"rx csum": 0x15, "tx csum": 0x17, "sg": 0x19, "tso": 0x1F, "gso": 0x24, "gro": 0x2C}
"""What an interface does to packets by itself: their checksums would be missing, and they would be longer than any."""
HELD_S = 0.03
"""How long a packet that is to be overtaken is held back."""


def make_plain(interface):
    """Have an interface send packets as they go over a wire."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        for command in OFF.values():
            value = array.array("B", struct.pack("II", command, 0))
            request = struct.pack("16sP", interface.encode(), value.buffer_info()[0])
            try:
                fcntl.ioctl(probe, SIOCETHTOOL, request)
            except OSError:
                continue  # this kind has it not


def tell(line):
    """Answer whoever set this up."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


class Emulator:
    """Two ends and what befalls packets between them."""

    def __init__(self, ends, rng):
        self._sockets = []
        for name in ends:
            end = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ETH_P_ALL))
            end.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
            end.bind((name, 0))
            end.setblocking(False)
            self._sockets.append(end)
        self._rng, self._faults = rng, {}
        self._waiting, self._n = [], 0
        self.counts = dict.fromkeys(("passed", "lost", "doubled", "held_back"), 0)

    def serve(self):
        """Pass packets on until standard input ends."""
        tell("ready")
        while True:
            wait_s = None if not self._waiting else max(0.0, self._waiting[0][0] - time.monotonic())
            ready, _, _ = select.select([*self._sockets, sys.stdin], [], [], wait_s)
            if sys.stdin in ready and not self._obey(sys.stdin.readline()):
                return
            for k, end in enumerate(self._sockets):
                if end in ready:
                    self._take(end, 1 - k)
            self._send_due()

    def _obey(self, line):
        if not line:
            return False
        asked = json.loads(line)
        if "counts" in asked:
            tell(json.dumps(self.counts))
        else:
            self._faults = asked
            tell("ok")
        return True

    def _take(self, end, other):
        while True:
            try:
                frame, address = end.recvfrom(65536)
            except BlockingIOError:
                return
            if address[2] != socket.PACKET_OUTGOING:
                self._pass(frame, other)

    def _pass(self, frame, other):
        faults, rng = self._faults, self._rng
        if faults.get("is_cut") or rng.random() < faults.get("loss", 0.0):
            self.counts["lost"] += 1
            return
        due_s = time.monotonic() + faults.get("delay_ms", 0.0) / 1e3
        if rng.random() < faults.get("reorder", 0.0):
            self.counts["held_back"] += 1
            due_s += HELD_S
        n = 1
        if rng.random() < faults.get("duplicate", 0.0):
            self.counts["doubled"] += 1
            n = 2
        for _ in range(n):
            self._n += 1
            heapq.heappush(self._waiting, (due_s, self._n, frame, other))

    def _send_due(self):
        while self._waiting and self._waiting[0][0] <= time.monotonic():
            _, _, frame, other = heapq.heappop(self._waiting)
            try:
                self._sockets[other].send(frame)
                self.counts["passed"] += 1
            except OSError:
                self.counts["lost"] += 1


if __name__ == "__main__":
    if sys.argv[1] == "--plain":
        make_plain(sys.argv[2])
    else:
        for name in sys.argv[1:]:
            make_plain(name)
        Emulator(sys.argv[1:], np.random.default_rng(1)).serve()
