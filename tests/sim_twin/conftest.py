"""What the tests of the monitor share: a stage on the rig `twin`."""

import pytest

from config.loader import resolve
from tests.support.monitor_stage import Stage


@pytest.fixture(scope="module")
def resolved():
    """The rig's files, checked together."""
    return resolve(rig="twin")


@pytest.fixture(scope="module")
def built(resolved):
    """One stage for a module: its physics takes longer to build than to lay out."""
    return Stage(resolved)


@pytest.fixture
def stage(built):
    """A stage whose table was just laid out."""
    built.lay_out()
    return built
