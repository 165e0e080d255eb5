"""Makes the sessions that lie here anew: `python -m tests.replay.make`, after a meant change of types or motion."""

from pathlib import Path
from tempfile import TemporaryDirectory

from config.loader import resolve
from robot.operated import OperatedStation
from robot.recording.cutting import cut
from robot.recording.messages import Purpose
from robot.recording.recording import Recording
from robot.recording.session_file import SessionFile
from robot.recording.topics import SCENE, TF
from robot.rigs import build_operator, build_station
from sim_twin.demonstrator import Demonstrator
from tests.support.recorded import learn_a_little, small_config

__all__ = ["LEARNT", "SHOWN", "main"]

HERE = Path(__file__).parent
LEARNT, SHOWN = HERE / "learnt.mcap", HERE / "shown.mcap"


def show(path: Path) -> None:
    """Record one goal shown by the scripted person."""
    resolved = resolve(rig="twin", scenario="paper")
    recording = Recording(path, resolved, purpose=Purpose.DRIVE, seed=0)
    local = build_station(resolved, is_driven=True, tap=recording.ticks)
    station = OperatedStation(local, build_operator(resolved.rig))
    station.connect()
    driven = recording.drive(local)
    assert Demonstrator(driven, resolved, seed=2).show(0, seed=1003, epoch=0)
    recording.close()
    station.close()


def main() -> None:
    """Write both, without what only viewers need."""
    with TemporaryDirectory() as folder:
        for make, out in ((learn, LEARNT), (show, SHOWN)):
            whole = Path(folder) / out.name
            make(whole)
            out.unlink(missing_ok=True)
            with SessionFile(whole) as session:
                topics = {session.topic_of(raw.channel) for raw in session.raw()} - {TF.name, SCENE.name}
            cut(whole, out, span=(0, 1 << 63), topics=sorted(topics))


def learn(path: Path) -> None:
    """Record two epochs of learning."""
    learn_a_little(path, n_epochs=2, seed=5, config=small_config(2, 12))


if __name__ == "__main__":
    main()
