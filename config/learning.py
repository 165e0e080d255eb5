"""How a learner learns: every reading of the paper is a key here. Presets lie in config/learning."""

from typing import Annotated
from typing import Literal as OneOf

from msgspec import Meta

from config.values import Name, NonNegative, Positive, Section, Share, Span

__all__ = [
    "Actions",
    "Experiment",
    "Expert",
    "ForwardModel",
    "GoalSelection",
    "LearningConfig",
    "Novelty",
    "SubgoalSelection",
]

Count = Annotated[int, Meta(ge=1, le=1_000_000)]
Width = Annotated[int, Meta(ge=1, le=4096)]
Error = Annotated[float, Meta(ge=1e-6, le=0.5)]
"""A chance of being misled: never none, or one contrary attempt would leave no belief at all."""
Rate = Annotated[float, Meta(gt=0.0, le=1.0)]
LearningRate = Annotated[float, Meta(ge=1e-6, le=0.1)]
"""Networks trained with more than this run off to no number."""
Part = Annotated[float, Meta(ge=0.0, lt=1.0)]
"""A share that leaves something: a belief that is all given up is none."""
Many = Annotated[int, Meta(ge=1, le=10_000)]
"""Every one of these is compared with others in one time step."""


class GoalSelection(Section, frozen=True, kw_only=True):
    """The bandit over goals, once an epoch."""

    temperature: Positive = 0.02
    ema_rate: Rate = 0.3
    window: Annotated[int, Meta(ge=2, le=100)] = 10
    """PT of equation (1)."""
    improvement: OneOf["printed", "clipped_success", "absolute"] = "printed"
    """Competence improvement: equation (1) as printed; clipped difference of mean successes; absolute difference."""
    prediction: OneOf["expert_utility", "running_success"] = "expert_utility"
    """Who predicts CP: the expert's utility at the trial's start, or the running success of the goal."""
    credit: OneOf["subgoal", "main_goal"] = "subgoal"
    """Which goal an attempt is credited to."""
    explored_worth: Share = 1.0
    """Result of an attempt at a sub-goal that curiosity brought about and not its model, for credit `subgoal`."""
    probability_floor: Share = 0.0
    """Least total probability spread over all goals whatever their values, so that none is lost sight of."""
    floor_by_failure: Share = 0.0
    """Part of the floor that is spread by how often epochs fail, the rest evenly: what no attempt improves yet has no
    value, and would be left alone with what is mastered."""
    rearm: bool = False
    """Raise a goal's value again when what it was believed to need has changed or it begins to fail."""
    rearm_value: Positive = 0.2
    """Value that a goal armed again has at least."""


class SubgoalSelection(Section, frozen=True, kw_only=True):
    """The choice of sub-goals, once a trial."""

    kind: OneOf["q", "q_hindsight", "q_drop", "mdp", "direct", "graph"] = "graph"
    temperature: OneOf["one_minus_improvement", "one_minus_competence", "fixed"] = "one_minus_competence"
    temperature_least: Positive = 0.01
    temperature_scale: NonNegative = 0.59
    competence_window: Count = 20
    known_context: bool = False
    """A failure counts only if the sub-goal was once achieved from this goal-state."""
    alpha: Rate = 0.1
    gamma: Share = 0.6
    dyna_replays: Annotated[int, Meta(ge=0, le=10_000)] = 20
    dyna_buffer: Count = 200
    max_literals: Annotated[int, Meta(ge=1, le=4)] = 3
    literal_cost: Annotated[float, Meta(ge=0.0, le=20.0)] = 1.2
    """Prior of a conjunction is exp(-cost * literals)."""
    hazard: Part = 0.01
    """Chance per attempt that the preconditions have changed: the change detector."""
    local_change: Part = 0.5
    """Share of those changes that are of one literal (one more, one fewer, turned round, exchanged); the others draw
    the preconditions anew."""
    false_positive: Error = 0.02
    """Chance that a goal is achieved although its preconditions do not hold."""
    blocked_error: Error = 0.05
    """Least chance that a trial counts as blocked although nothing was missing."""
    curiosity: Share = 0.0
    """Chance per epoch that a doubtful precondition is tried out before the plan is followed."""
    least_doubt: Share = 0.1
    """Least chance of being wrong, per trial that it takes to find out, that makes a precondition worth that."""
    probe_trials: Count = 6
    """Most trials that trying it out and following the plan may take together."""
    retest: Share = 0.0
    """Chance per epoch that something believed is tried out again, to notice what is needed no longer."""
    use_blocked_only: bool = True
    """Trials that reached the place but were blocked are full evidence against, others only by miss_weight."""
    miss_weight: Share = 0.5
    """Power of the evidence of a trial that did not reach the place, on top of what the expert's skill makes of it."""


class Expert(Section, frozen=True, kw_only=True):
    """The utility model of one goal."""

    hidden: Annotated[tuple[Width, ...], Meta(min_length=1, max_length=4)] = (64, 64)
    learning_rate: LearningRate = 1e-3
    batch: Count = 128
    updates_per_trial: Annotated[int, Meta(ge=0, le=10_000)] = 20
    trace: Count = 70
    """Longest part of a trial, counted back from its end, that is learnt from."""
    buffer_steps: Count = 20_000
    established_after: Count = 10
    """Successes after which the expert alone moves the arm."""
    relevance_power: NonNegative = 3.0
    """How sharply inputs are weighted by how steady their distance was at success; 0 weighs all alike."""
    relevance_until: Count = 10
    """Successes up to which the weights change with each, later only now and then, and never of a settled expert."""
    failure_tail: Count = 20
    """Time steps at the end of a failed trial that are learnt as worthless."""
    failure_weight: NonNegative = 4.0
    """How much more often a failed step is drawn than a successful one, up to failure_share of a batch."""
    expectile: Annotated[float, Meta(gt=0.0, lt=1.0)] = 0.8
    """Above 0.5, better traces through a place count for more than worse ones."""
    boredom: NonNegative = 0.004
    """Utility taken off places like those of the trial's steps, for each; more where nothing moved."""
    boredom_sigma: Positive = 0.05
    lamps_drawn: Share = 0.5
    """Share of a batch in which lamps are drawn at random, and whether they are in failures; 0 leaves it out."""
    carried_out: Share = 1.0
    """Share of trials in which the arm does what the expert asks; in the others it strays, and nobody is told. Below 1
    to see what those above an expert bear."""
    detour: Annotated[int, Meta(ge=0, le=1000)] = 15
    """Time steps for which curiosity leads a model away that is stuck, while learning; 0 leaves it where it is."""
    horizon: Count = 70
    """Steps over which utility falls from 1 to 0 along a success trace."""
    failure_share: Share = 0.3
    """Share of failures in a batch."""
    settled_misses: Annotated[int, Meta(ge=0, le=20)] = 1
    """An expert that failed no more often than this in its last 20 trials is left as it is."""
    rate_half: Positive = 20.0
    """Successes after which the learning rate is half of what it was at first; it rises again while trials fail."""
    scales_m: Annotated[tuple[Span, ...], Meta(max_length=4)] = (0.1, 0.03)
    """Ranges of the exponentials that a distance is normalised by."""


class Novelty(Section, frozen=True, kw_only=True):
    """Exploration before there is something to exploit: go where P(t) is unlike the recent past."""

    memory: Many = 200
    temperature: Positive = 0.05
    near_only: bool = False
    """Only how near things are can be new; all that is far looks alike. For a model that does not know the fences."""
    wishes: Many = 512
    """Places compared when a new wish is made."""
    reach_m: Span = 0.5
    """How far off a wish may be."""
    still_m: Span = 0.002
    """P counts as still when no distance changes more than this in a time step."""


class ForwardModel(Section, frozen=True, kw_only=True):
    """Who predicts P(t+1) of a candidate move."""

    kind: OneOf["geometric", "learned"] = "geometric"
    hidden: Annotated[tuple[Width, ...], Meta(min_length=1, max_length=4)] = (64, 64)
    history: Annotated[int, Meta(ge=1, le=64)] = 20
    """Time steps from which it is told what comes along with the hand."""
    learning_rate: LearningRate = 1e-3
    batch: Count = 64
    updates_per_trial: Annotated[int, Meta(ge=0, le=10_000)] = 30
    rate_half: Positive = 200.0
    """Trials after which it is trained half as much as at first."""
    buffer_steps: Count = 8_000


class Actions(Section, frozen=True, kw_only=True):
    """Candidate moves rated at each time step."""

    n_headings: Annotated[int, Meta(ge=3, le=360)] = 20
    distance_shares: Annotated[tuple[Share, ...], Meta(min_length=1, max_length=8)] = (1.0, 0.35)
    """Step lengths as shares of the longest step."""


class Experiment(Section, frozen=True, kw_only=True):
    """Epochs, trials and time steps, as the paper has them."""

    epochs: Count = 2000
    trials: Count = 8
    steps: Count = 70
    evaluate_every: Count = 50
    test_epochs: Count = 10
    """Test epochs a goal at each evaluation."""
    dense_every: Count = 10
    dense_for: Annotated[int, Meta(ge=0)] = 0
    """Evaluate every dense_every epochs for this many epochs after the start and after each change of rules."""
    checkpoint_every: Count = 50
    retreat: bool = True
    """Between the trials of an epoch the tool rises to travel height: given, and not counted as time steps."""
    blocked_after: Annotated[int, Meta(ge=1, le=1000)] = 3
    """So many time steps at the sub-goal's place to no effect make a trial a blocked one."""
    end_blocked: bool = True
    """End a trial as soon as it counts as blocked: there is nothing more to learn from it."""
    void_limit: Count = 10
    """So many void epochs running fail the run."""


class LearningConfig(Section, frozen=True, kw_only=True):
    """One learner and its protocol."""

    name: Name
    description: str = ""
    experiment: Experiment = Experiment()
    goal_selection: GoalSelection = GoalSelection()
    subgoal_selection: SubgoalSelection = SubgoalSelection()
    expert: Expert = Expert()
    novelty: Novelty = Novelty()
    forward_model: ForwardModel = ForwardModel()
    actions: Actions = Actions()
