"""What a film of a run shows, scene by scene, as its tables tell. Pure."""

from collections.abc import Sequence

import msgspec

from learning.report import Run
from learning.rows import GoalRow
from learning.run_folder import Manifest

__all__ = ["FILM_S", "HELD_S", "Card", "Examined", "Lived", "Scene", "allotted", "name_of", "story_of"]

N_FIRST = 3
"""Epochs that are shown of the beginning."""
LOOKED_FOR = 30
"""Epochs after a change in which one that fails is looked for."""
FILM_S = 60.0
CARD_S, FIRST_S, TESTED_S, BROKEN_S, AGAIN_S, LAST_S = 3.0, 12.0, 9.0, 12.0, 7.0, 5.0
HELD_S = 1.2
"""How long the end of what moves is held."""


class Card(msgspec.Struct, frozen=True, kw_only=True):
    """Text and the chart, nothing moves."""

    seconds: float
    at: int
    """Epochs up to which the chart is shown."""
    title: str
    says: str


class Lived(msgspec.Struct, frozen=True, kw_only=True):
    """Epochs of learning as they were, lived again."""

    seconds: float
    """In proportion to other such scenes: they share what time the rest leaves."""
    at: int
    """The first of them."""
    n_epochs: int
    title: str
    says: str


class Examined(msgspec.Struct, frozen=True, kw_only=True):
    """A test epoch of what was learnt, learning off."""

    seconds: float
    """At most."""
    at: int
    """Epochs learnt."""
    rules_epoch: int
    goal: int
    title: str
    says: str


Scene = Card | Lived | Examined


def name_of(goal: int, manifest: Manifest) -> str:
    """Return a goal's name as people read it."""
    return manifest.goals[goal].name.replace("_", " ")


def story_of(run: Run) -> tuple[Scene, ...]:
    """Return the scenes: how it began, what it learnt and, where the rules changed, what broke and was learnt anew."""
    manifest, n_done = run.manifest, run.summary.n_epochs
    change = next((epoch for epoch in manifest.changes if 0 < epoch < n_done), None)
    scenes: list[Scene] = [
        Card(
            seconds=CARD_S, at=0, title=_headline(manifest),
            says="An arm teaches itself goals, and which of them need which others.",
        ),
        Lived(
            seconds=FIRST_S, at=0, n_epochs=min(N_FIRST, n_done), title="It begins with nothing",
            says="No goal was ever achieved: curiosity moves the arm.",
        ),
    ]  # fmt: skip
    scenes.append(_test(run, 0, change or n_done))
    if change is not None:
        scenes += _after_change(run, change)
    scenes.append(Card(seconds=LAST_S, at=n_done, title="What it came to", says=_figures(run)))
    return tuple(scenes)


def allotted(scenes: Sequence[Scene], lengths_s: Sequence[float]) -> list[float]:
    """Return how long each scene is shown, seconds, so that all together take a minute.

    What moves is never shown slower than it was, and its end is held. If that leaves time over, the last card has it.

    Args:
        scenes: of the story, a card at the end.
        lengths_s: how long what moves took; anything for cards.
    """
    taken = [
        min(length, scene.seconds) + HELD_S if isinstance(scene, Examined) else scene.seconds
        for scene, length in zip(scenes, lengths_s, strict=True)
    ]
    lived = [i for i, scene in enumerate(scenes) if isinstance(scene, Lived)]
    left = FILM_S - sum(seconds for i, seconds in enumerate(taken) if i not in lived)
    for i in lived:
        weight = scenes[i].seconds / sum(scenes[k].seconds for k in lived)
        taken[i] = min(left * weight, lengths_s[i] + HELD_S)
    taken[-1] += max(0.0, FILM_S - sum(taken))
    return taken


def _after_change(run: Run, change: int) -> list[Scene]:
    until = next((epoch for epoch in run.manifest.changes if change < epoch < run.summary.n_epochs), None)
    at = until or run.summary.n_epochs
    broken = _broken(run.goal_rows, change)
    what = name_of(broken.goal, run.manifest)
    came = "is not achieved" if not broken.is_achieved else f"takes {broken.n_trials} trials"
    scenes: list[Scene] = [
        Card(
            seconds=CARD_S, at=change, title=f"Epoch {change}: the rules change",
            says="Other things are needed now. Nobody tells the learner.",
        ),
        Lived(
            seconds=BROKEN_S, at=broken.epoch, n_epochs=1, title="What worked works no longer",
            says=f"{what} {came}: learning epoch {broken.epoch - change + 1} after the change.",
        ),
    ]  # fmt: skip
    hardest = _test(run, 1, at)
    if hardest.goal != broken.goal:
        says = f"A test, learning off: {what}, which had failed."
        again = {"seconds": AGAIN_S, "goal": broken.goal, "says": says}
        scenes.append(msgspec.structs.replace(hardest, **again))
    return [*scenes, hardest]


def _test(run: Run, era: int, at: int) -> Examined:
    """Return the test of the goal that takes the most trials under one set of rules."""
    optima = [0 if best is None else best for best in run.manifest.optima[era]]
    goal = max(range(len(optima)), key=optima.__getitem__)
    told = run.summary.eras[era]
    word = "learnt" if era == 0 else "learnt anew"
    title = f"{at - told.from_epoch} epochs under {'the first' if era == 0 else 'the new'} rules"
    after = "" if told.learnt_after is None else f" All goals were {word} after {told.learnt_after}."
    says = f"A test, learning off: {name_of(goal, run.manifest)}, at best in {optima[goal]} trials.{after}"
    return Examined(seconds=TESTED_S, at=at, rules_epoch=at - 1, goal=goal, title=title, says=says)


def _broken(rows: Sequence[GoalRow], change: int) -> GoalRow:
    """Return the first epoch after a change that failed, else the one that took most trials."""
    since = [row for row in rows if change <= row.epoch < change + LOOKED_FOR and not row.is_void]
    failed = next((row for row in since if not row.is_achieved), None)
    return failed or max(since, key=lambda row: row.n_trials)


def _headline(manifest: Manifest) -> str:
    return f"{manifest.learner} on {manifest.scenario}, seed {manifest.seed}"


def _figures(run: Run) -> str:
    told = [
        f"{'learnt' if i == 0 else f'recovered from the change at {era.from_epoch}'} "
        f"{'not yet' if era.learnt_after is None else f'after {era.learnt_after} epochs'}"
        for i, era in enumerate(run.summary.eras)
    ]
    text = "; ".join(told)
    return f"{text[0].upper()}{text[1:]}. {run.summary.n_epochs:,} epochs, {run.summary.n_time_steps:,} decisions."
