"""What an idle `virtual_lab` costs: the share of a processor that each of its processes takes. The edge."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from robot.bench import BenchResult
from robot.bus.errors import BusError

__all__ = ["idle_rows"]

RIG = "virtual_lab"
START_S, SETTLE_S, LOOK_S, END_S = 120.0, 3.0, 10.0, 90.0
STARTED = re.compile(r"(\w+): started as process (\d+)")
TICKS_PER_S = os.sysconf("SC_CLK_TCK")


def idle_rows() -> list[BenchResult]:
    """Start the rig without its learner, and return how busy each process is for ten seconds.

    Raises:
        BusError: it does not start.
    """
    with TemporaryDirectory() as folder:
        words = ["up", RIG, "--without", "learning", "--out", folder]
        process = subprocess.Popen(
            [sys.executable, "-c", "from robot.cli import main; main()", *words], stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL, cwd=Path(__file__).parents[2],
        )  # fmt: skip
        try:
            pids = _started(process, Path(folder) / "logs" / "supervisor.log")
            time.sleep(SETTLE_S)
            before, begun_s = {name: _busy_s(pid) for name, pid in pids.items()}, time.monotonic()
            time.sleep(LOOK_S)
            seconds = time.monotonic() - begun_s
            shares = {name: (_busy_s(pid) - before[name]) / seconds for name, pid in pids.items()}
        finally:
            _end(process)
    return [
        BenchResult(name=f"idle_cpu_share_{name}", value=share, unit="1", details={"of": "one processor"})
        for name, share in shares.items()
    ]


def _end(process: "subprocess.Popen[bytes]") -> None:
    """End the rig as Ctrl-C does; what hangs is killed, and its nodes end with it."""
    process.send_signal(signal.SIGINT)
    try:
        process.wait(END_S)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _started(process: "subprocess.Popen[bytes]", log: Path) -> dict[str, int]:
    """Wait until the last node is there, and return all by name; the supervisor starts one after another is heard."""
    end_s = time.monotonic() + START_S
    while time.monotonic() < end_s and process.poll() is None:
        found = {name: int(pid) for name, pid in STARTED.findall(log.read_text() if log.exists() else "")}
        if "robot" in found:
            return found | {"supervisor": process.pid}
        time.sleep(0.2)
    raise BusError(f"bench bus: expected {RIG} to start within {START_S:g} s, it did not; does one run already?")


def _busy_s(pid: int) -> float:
    """Return the processor time of a process and of those that it started and that run, by the kernel's count."""
    family, busy = [pid], 0.0
    while family:
        own = family.pop()
        try:
            fields = Path(f"/proc/{own}/stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        busy += (int(fields[11]) + int(fields[12])) / TICKS_PER_S
        if own == pid:
            family += _children_of(own)
    return busy


def _children_of(pid: int) -> list[int]:
    """Return the processes that one has started, none of a session of their own: those are nodes of the rig."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        number = int(stat.parent.name)
        if int(fields[1]) == pid and int(fields[3]) != number:
            found.append(number)
    return found
