"""Which commit this is, where the package lies in a checkout. The edge: asks git."""

import subprocess
from pathlib import Path

__all__ = ["git_revision"]

GIT_PATIENCE_S = 5.0


def git_revision() -> str | None:
    """Return the commit of the checkout that this package lies in, -dirty where files differ; None outside one."""
    root = Path(__file__).parents[1]
    if not (root / ".git").exists():
        return None
    command = ["git", "-C", str(root), "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=GIT_PATIENCE_S, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout.strip() or None
