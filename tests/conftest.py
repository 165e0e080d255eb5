"""Settings that all tests share."""

import os
import signal

os.environ.setdefault("OMP_NUM_THREADS", "1")
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A shell starts what is in its background so, and the commands that tests interrupt would inherit it and never end.
    signal.signal(signal.SIGINT, signal.default_int_handler)

from hypothesis import settings

settings.register_profile("autotelic", derandomize=True, deadline=None)
settings.load_profile("autotelic")
