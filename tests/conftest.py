"""Settings that all tests share."""

import os
import signal
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell starts what is in its background so, and the commands that tests interrupt would inherit it and never end.
    signal.signal(signal.SIGINT, signal.default_int_handler)

from hypothesis import settings

settings.register_profile("autotelic", derandomize=True, deadline=None)
settings.load_profile("autotelic")

LONGEST = ("abstract_experiment", "wheel", "cli", "twin_run", "experts", "picture")
"""Files of few tests that take long: they begin where files are dealt out, so that none is waited for alone."""


def pytest_collection_modifyitems(items):
    order = {f"test_{name}.py": place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(Path(item.path).name, len(order)))
