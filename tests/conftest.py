"""Settings that all tests share."""

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

from hypothesis import settings

settings.register_profile("autotelic", derandomize=True, deadline=None)
settings.load_profile("autotelic")
