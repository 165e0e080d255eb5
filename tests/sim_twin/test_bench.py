from config.loader import resolve
from sim_twin.bench import FIRST_SEED, _pick_all
from sim_twin.pilot import Pilot


def test_no_table_that_contacts_were_chosen_on_is_reported(monkeypatch):
    seeds, reset = [], Pilot.reset

    def noted(pilot, *, seed, epoch):
        seeds.append(seed)
        return reset(pilot, seed=seed, epoch=epoch)

    monkeypatch.setattr(Pilot, "reset", noted)
    _pick_all(resolve(), 2)
    assert seeds == [FIRST_SEED, FIRST_SEED + 1]
    assert FIRST_SEED >= 200
