import numpy as np

from config.loader import resolve
from sim_twin.bench import open_twin
from sim_twin.picks import FIRST_SEED, OFF_CENTRE_M, pick_all, pick_off_centre
from sim_twin.pilot import Pilot


def test_no_table_that_contacts_were_chosen_on_is_reported(monkeypatch):
    seeds, reset = [], Pilot.reset

    def noted(pilot, *, seed, epoch):
        seeds.append(seed)
        return reset(pilot, seed=seed, epoch=epoch)

    monkeypatch.setattr(Pilot, "reset", noted)
    pick_all(*open_twin(resolve()), 2)
    assert seeds == [FIRST_SEED, FIRST_SEED + 1]
    assert FIRST_SEED >= 200


def test_beside_the_centre_is_where_the_tool_really_comes_down_and_what_it_misses_counts_as_not_taken(monkeypatch):
    beside_m, down = [], Pilot.down

    def noted(pilot, until, *, limit=60):
        tool = np.array(pilot.percept.tcp_position_m[:2])
        places = [np.array(pilot.where(name)[:2]) for name in ("red_cylinder", "blue_cylinder")]
        beside_m.append(min((tool - place for place in places), key=np.linalg.norm))
        return down(pilot, until, limit=limit)

    monkeypatch.setattr(Pilot, "down", noted)
    picks = pick_off_centre(*open_twin(resolve()), 12)
    off_m = np.abs(beside_m)
    assert off_m.max() <= OFF_CENTRE_M + 1e-3
    assert (off_m.max(axis=0) > 0.7 * OFF_CENTRE_M).all()
    taken = [pick.was_held for pick in picks]
    assert 0 < sum(taken) < len(taken)
    across_m = off_m[:, 0]
    assert across_m[taken].max() < across_m[np.logical_not(taken)].min()
    assert not any(pick.is_held for pick in picks if not pick.was_held)


def test_the_same_tables_and_places_are_picked_each_time():
    one, two = (pick_off_centre(*open_twin(resolve()), n) for n in (3, 4))
    assert one == two[:3]
