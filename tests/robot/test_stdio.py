"""Standard output is for answers: what a library writes there at the descriptor goes to standard error meanwhile."""

import subprocess
import sys
from pathlib import Path

SCRIPT = """
import os, subprocess, sys
from robot.stdio import STDERR, redirected_stdout
print("before")
with redirected_stdout(STDERR):
    os.write(1, b"from C\\n")
    print("from Python")
    subprocess.run([sys.executable, "-c", "print('from a child')"], check=True)
print("after")
"""


def test_what_is_written_meanwhile_goes_to_standard_error_by_whatever_way_and_nothing_else_does():
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], cwd=Path(__file__).parents[2], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == ["before", "after"]
    assert sorted(done.stderr.splitlines()) == ["from C", "from Python", "from a child"]
