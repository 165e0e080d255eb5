"""Two machines on one: network namespaces with a cable between them, or with a link emulator in the middle.

Root and iproute2 are needed; where they are not, `why_not` says so and tests skip.
"""

import ctypes
import json
import os
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

__all__ = ["Cable", "EmulatedCable", "inside", "why_not"]

CLONE_NEWNET = 0x40000000
EMULATOR = Path(__file__).with_name("link_emulator.py")
_libc = ctypes.CDLL(None, use_errno=True)


def why_not():
    """Return why no namespaces can be made here, None where they can."""
    if os.geteuid() != 0 or shutil.which("ip") is None:
        return "expected root and iproute2 for network namespaces"
    probe = f"atprobe{os.getpid()}"
    made = subprocess.run(["ip", "netns", "add", probe], capture_output=True, text=True, check=False)
    if made.returncode:
        return f"expected network namespaces: {made.stderr.strip()}"
    subprocess.run(["ip", "netns", "del", probe], check=True)
    return None


def run(*words):
    subprocess.run(words, check=True, capture_output=True)


@contextmanager
def inside(name):
    """Have this thread's new sockets be of a namespace."""
    home = os.open("/proc/thread-self/ns/net", os.O_RDONLY)
    there = os.open(f"/var/run/netns/{name}", os.O_RDONLY)
    try:
        assert _libc.setns(there, CLONE_NEWNET) == 0, os.strerror(ctypes.get_errno())
        yield
    finally:
        assert _libc.setns(home, CLONE_NEWNET) == 0, os.strerror(ctypes.get_errno())
        os.close(home)
        os.close(there)


class Cable:
    """Two namespaces and a cable.

    Args:
        a: address of the first, of a /24 that both share.
        b: address of the other.

    Attributes:
        a: Name of the first namespace.
        b: Name of the other.
    """

    def __init__(self, a, b):
        stem = f"at{os.getpid() % 100000}"
        self.a, self.b = f"{stem}a", f"{stem}b"
        self._names = [self.a, self.b]
        self._addresses = {self.a: a, self.b: b}

    def __enter__(self):
        for name in self._names:
            run("ip", "netns", "add", name)
            run("ip", "-n", name, "link", "set", "lo", "up")
        try:
            self._join()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        for name in self._names:
            subprocess.run(["ip", "netns", "del", name], check=False, capture_output=True)

    def command(self, name, *words):
        """Return the words that run a command in a namespace."""
        return ["ip", "netns", "exec", name, *map(str, words)]

    def _join(self):
        run("ip", "link", "add", "eth0", "netns", self.a, "type", "veth", "peer", "name", "eth0", "netns", self.b)
        for name in (self.a, self.b):
            self._raise(name, "eth0")

    def _raise(self, name, interface):
        run("ip", "-n", name, "addr", "add", f"{self._addresses[name]}/24", "dev", interface)
        run("ip", "-n", name, "link", "set", "dev", interface, "up")


class EmulatedCable(Cable):
    """The same with a process of ours in the middle that takes each packet and passes it on, or does not."""

    def __init__(self, a, b):
        super().__init__(a, b)
        self._middle = self.a[:-1] + "m"
        self._names.append(self._middle)
        self._process = None

    def set(self, **faults):
        """Have faults from now on: `delay_ms`, `loss`, `duplicate`, `reorder` (shares), `is_cut`; none without."""
        self._process.stdin.write(json.dumps(faults) + "\n")
        self._process.stdin.flush()
        assert self._process.stdout.readline().strip() == "ok"

    def counts(self):
        """Return how many packets were passed, lost, doubled and held back so far."""
        self._process.stdin.write(json.dumps({"counts": True}) + "\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def __exit__(self, *_):
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
        super().__exit__()

    def _join(self):
        for name, inner in ((self.a, "mid0"), (self.b, "mid1")):
            run(
                "ip", "link", "add", "eth0", "netns", name, "type", "veth", "peer", "name", inner, "netns", self._middle
            )
            self._raise(name, "eth0")
            run("ip", "-n", self._middle, "link", "set", "dev", inner, "up")
            run(*self.command(name, sys.executable, EMULATOR, "--plain", "eth0"))
        self._process = subprocess.Popen(
            self.command(self._middle, sys.executable, EMULATOR, "mid0", "mid1"), stdin=subprocess.PIPE,
            stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self._process.stdout.readline().strip() == "ready"
