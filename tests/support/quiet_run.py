"""A run in this process, without progress and without figures, up to any epoch."""

from learning.run_folder import RunFolder
from learning.session import open_session
from learning.stopwatch import Stopwatch

__all__ = ["Quiet", "learn_quietly"]


class Quiet:
    """Watches (learning.experiment.Watcher), and keeps what it is told of goals."""

    def __init__(self):
        self.met, self.n_steps = [], 0

    def epoch_begins(self, epoch, goal):
        pass

    def epoch_ended(self, record):
        pass

    def evaluated(self, rows):
        pass

    def say(self, line):
        pass

    def goals_met(self, epoch, goals):
        self.met.append((epoch, tuple(goals)))


def learn_quietly(out, wanted, *, until=10**9, watcher=None):
    """Begin what is wanted in a folder, or go on with it, up to an epoch; return the folder and who watched."""
    own, watcher = RunFolder(out), watcher or Quiet()
    with own:
        session = open_session(own, wanted, resume=True, stopwatch=Stopwatch())
        n_asked = session.n_done

        def should_stop():
            nonlocal n_asked
            n_asked += 1
            return n_asked > until

        try:
            session.run(watcher, n_workers=0, should_stop=should_stop)
        finally:
            session.close()
    return own, watcher
