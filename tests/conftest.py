"""Settings that all tests share."""

import os
import signal
import sys
from pathlib import Path

from hypothesis import settings

os.environ.setdefault("OMP_NUM_THREADS", "1")
# Where an image forbids it, some hundred processes would compile all modules anew, and each run all tests.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell starts what is in its background so, and the commands that tests interrupt would inherit it and never end.
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("autotelic", derandomize=True, deadline=None)
settings.load_profile("autotelic")

LONGEST = ("abstract_experiment", "wheel", "cli", "twin_run", "experts", "picture")
"""Files of few tests that take long: they begin where files are dealt out, so that none is waited for alone."""


def pytest_sessionstart():
    """Forget what safety's functions worked out: a mutant's run begins in a copy of a process that ran them whole."""
    for name, module in list(sys.modules.items()):
        if name.startswith("robot.safety"):
            for value in list(vars(module).values()):
                if hasattr(value, "cache_clear"):
                    value.cache_clear()


def pytest_collection_modifyitems(items):
    order = {f"test_{name}.py": place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(Path(item.path).name, len(order)))
