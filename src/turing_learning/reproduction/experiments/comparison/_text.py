"""What the comparison says in words: what each method is given, and where which one is better."""

from collections.abc import Iterator, Sequence

from turing_learning.analysis import WHY_UNKNOWN
from turing_learning.swarm import Scenario

from ._outcome import METHODS, MIXTURE, TURING_LEARNING, Outcome

CONDITIONS = (
    "A trial is the paper's, 10 s of agents and one replica. Every method that simulates has the same number of them. All get the "
    "agents' motion and no more: Turing Learning that of its own trials, the others that of 1000 trials with replicas of random "
    "models, which are not counted (the mixture: 10, 100 and 1000).",
    "**Turing Learning** (default preset, its `estimate`) must know how a replica senses, a range for the first models, [-1, 1], "
    "and a scale for each signal. It is given no prior, no summaries and no distance, and may search outside the range. Agents "
    "must be there while it runs.",
    "**ABC-SMC** (`pyabc`) and **NPE** (`sbi`), in one round and in two truncated ones, must know a bounded prior, uniform in "
    "[-1.5, 1.5], and **summaries made by hand**, which Turing Learning is not given. They are of the wheel speeds, so wheel "
    "distance and largest speed must be known: mean, standard deviation, autocorrelations at lags of 1 and 10 cycles, covariance, "
    "and the means of both wheels in each twentieth of the cycles in the order of the turn rate, because a reactive robot turns "
    "at another rate in each sensor state. A model is simulated in 10 trials, to tell its summaries from chance. Settings are the "
    "packages' defaults (ABC-SMC: 1-norm with adaptive weights, populations of twice the square root of the number of models; "
    "estimates: medians).",
    "**The mixture** (scikit-learn) must know that behavior is piecewise constant in time, how many sensor states there are, how "
    "the wheels make the motion, and which state is rarer than which. It needs no simulator and no sensor model. It fits one "
    "component for each state and a spare one for collisions; the centers are the wheel speeds.",
    "What the others give beside: ABC-SMC and NPE a posterior with all correlations, NPE in one round a network that infers other "
    "recordings of the same kind without a new simulation; the mixture an answer from one short recording.",
    "What they do not: neither summaries nor levels of speed are at hand where behavior is not known to be reactive, where "
    "memory or noise hide the levels, or where parameters (a field of view, a range) do not show in the speeds of a moment. "
    "Nothing of this is tested here: reactive robots are the mixture's best case.",
    "Intervals are the central 90 %. Those of ABC-SMC and NPE are what the motion of 10 individuals leaves open, although the "
    "summaries observed are of thousands: they are wider than they need be.",
    "Not equal: the default preset was tuned on these two scenarios (with other seeds), the others not at all, but their "
    "summaries were chosen here, knowing the behaviors, on seed 1. Whole swarms of replicas would give ABC-SMC and NPE eleven, "
    "or five, samples a trial instead of one, without agents; a network on the raw motion would spare NPE the summaries. Both "
    "are left out.",
    "Time is that of one processor core, without imports.",
)


def remarks(outcomes: Sequence[Outcome]) -> list[str]:
    """Return sentences in Markdown: who is how accurate, and where Turing Learning is beaten."""
    scenarios = list(dict.fromkeys(one.scenario.name for one in outcomes))
    texts = []
    for name in scenarios:
        own = [one for one in outcomes if one.scenario.name == name]
        texts += [_ranking(own[0].scenario, trials, own) for trials in _budgets(own)]
        texts.append(_defeats(own))
        texts += _unknown(own)
    return texts


def _budgets(outcomes: Sequence[Outcome]) -> list[int]:
    return [one.trials for one in outcomes if one.method == TURING_LEARNING]


def _ranking(scenario: Scenario, trials: int, outcomes: Sequence[Outcome]) -> str:
    ranked = sorted(
        (one for one in outcomes if one.trials == trials and one.method != MIXTURE), key=lambda one: one.mae
    )
    fit = max((one for one in outcomes if one.method == MIXTURE), key=lambda one: one.trials)
    listing = ", ".join(_named(one) for one in ranked)
    return (
        f"{scenario.title}, {trials:,} simulated trials, median MAE (of the worst seed; time): {listing}; "
        f"{_named(fit)} without any, from {fit.trials:,} observed ones."
    )


def _named(outcome: Outcome) -> str:
    return f"{METHODS[outcome.method]} {outcome.mae:.4f} ({outcome.worst:.4f}; {outcome.seconds:.1f} s)"


def _defeats(outcomes: Sequence[Outcome]) -> str:
    """Say in which respects the others beat Turing Learning in one scenario."""
    own = {one.trials: one for one in outcomes if one.method == TURING_LEARNING}
    others = [one for one in outcomes if one.method != TURING_LEARNING]
    wins = [text for one in others for text in _wins(one, own[max(own) if one.method == MIXTURE else one.trials])]
    title = outcomes[0].scenario.title
    return f"**Where the others win, {title.lower()}:** {'; '.join(wins) if wins else 'nowhere'}."


def _unknown(outcomes: Sequence[Outcome]) -> Iterator[str]:
    """Say how many intervals are not known, if there are some."""
    some = [f"{METHODS[one.method]} {one.unknown} with {one.trials:,} trials" for one in outcomes if one.unknown]
    if some:
        yield f"Intervals that are not known, and count as not holding the truth: {', '.join(some)}: {WHY_UNKNOWN}."


def _wins(other: Outcome, own: Outcome) -> Iterator[str]:
    name, effort = (
        METHODS[other.method],
        f"{other.trials:,} {'observed' if other.method == MIXTURE else 'simulated'} trials",
    )
    against = f"Turing Learning with {own.trials:,}" if other.method == MIXTURE else "Turing Learning"
    better = []
    if other.mae < own.mae:
        better.append(f"a smaller median error ({other.mae:.4f}, {own.mae:.4f})")
    if other.seconds < own.seconds:
        better.append(f"less time ({other.seconds:.1f} s, {own.seconds:.1f} s)")
    if better:
        yield f"{name} with {effort} has {' and '.join(better)} than {against}"
