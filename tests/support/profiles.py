"""Profiles of the shipped limits file, whole and changed."""

from msgspec.structs import replace

from config.limited import limited
from config.limits import Speeds, Workspace
from config.loader import load_arm, load_limits
from robot.envelope import Envelope

ARM = load_arm("ur5e")
LIMITS = load_limits("ur5e_parallel_jaw_85")


ANY_RATE = dict.fromkeys(("acceleration_rad_s2", "jerk_rad_s3", "stop_acceleration_rad_s2", "stop_jerk_rad_s3"), 1e9)
"""A joint that may change its speed as it likes."""


def profile(name="unattended", **changes):
    """Return a shipped profile with some of its parts replaced."""
    return replace(LIMITS.profile(name), **changes)


def envelope(tick_s, name="unattended", **changes):
    """Return a shipped profile made ready for a tick."""
    held = profile(name, **changes)
    return Envelope.of(held, limited(ARM, held), tick_s=tick_s)


def fenced(**space):
    """Return a workspace of these fences only."""
    return Workspace(**space)


def open_envelope(tick_s=0.01):
    """Return limits of a profile that nothing meets, for tests of everything else."""
    held = profile(
        joints=tuple(replace(j, soft_margin_rad=0.0, **ANY_RATE) for j in profile().joints),
        speeds=Speeds(tcp_m_s=1e3, elbow_m_s=1e3, flange_m_s=1e3),
        workspace=Workspace(),
    )
    return Envelope.of(held, ARM, tick_s=tick_s)
