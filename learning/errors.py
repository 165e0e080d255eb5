"""Errors of the learning package, in families by who must act."""

__all__ = ["CheckpointError", "LearningError", "RunFolderError", "TooManyVoidEpochsError"]


class LearningError(Exception):
    """Root of everything this package raises on purpose."""


class RunFolderError(LearningError, ValueError):
    """A run folder is not what the command needs: name another one, or resume."""


class CheckpointError(LearningError):
    """A checkpoint is torn, of another kind, or holds what it may not hold."""


class TooManyVoidEpochsError(LearningError):
    """Epoch after epoch was cut short: a person must look at the plant."""
