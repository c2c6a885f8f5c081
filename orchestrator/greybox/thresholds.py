"""All thresholds of the grey-box diagnosis, each with its meaning."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Thresholds:
    """Limits of search and decision.

    Search: sets of up to `largest_set` effects are proposed at once about the model as given; `shortlist` of them are fitted, and
    the best `singles` of one effect, among all sets and among those of forces alone. About the `extended` best sets `additions` further
    effects are tried, in at most `rounds`, up to `most_effects`. What makes left-out
    blocks less probable by more than `hopeless` nats is not fitted. All parameters of a model that has no more than
    `most_parameters` are tried as wrong together. What runs of the filter take is counted (`GreyBox.work`), and after `most_work`
    nothing more is fitted but what the decision asks for.

    A periodic force is tried where the strongest of all frequencies would be as strong `by_chance` no more often than this.

    Decision: a set is better than another beyond doubt if its log likelihood, less the price of its parameters, is higher by
    `standard_errors` of the sum of differences over stretches and by `nats`. An effect earns its place if predictions over the
    horizon are `least_improvement` better with it, or if it brings `least_share` of what the whole set gains; the latter never if they are
    `worse` by more than that share, nor if it takes away less than `least_power` of the disturbing forces' power and is no sensor's. A set is out if
    one with as few parameters predicts `defeated` better, and not named if a smooth force predicts `least_improvement` better.
    What explains less than `least_explained` of the disturbing forces' power, or improves predictions by less than
    `least_improvement` over the horizon and over whole trials, is not named. Predictions are alike within `alike`, and then
    fewer parameters are chosen. Sets whose log likelihoods differ by less than `nats`, and whose equations agree, are one model in
    other parameters: the one without surprising values, and with the fewest effects beside wrong parameters, is named. An answer is incomplete if more than `complete_share` is unexplained.

    Rare effects are tried, too, if the answer is ambiguous, or leaves more than noise and more than `rare_share` of the missing force or of
    a signal's squared error along whole trials, or a parameter of it is more than `surprising` standard deviations of its prior off.

    The horizon is an eighth of a trial, a quarter of that or a sixteenth: the longest over which one of the `likeliest` sets errs by less than
    `predictable` times the signals' spread.

    Process noise that makes the record more probable by less than `quiet` nats for each balance is none, and so is one without
    which sensors seem no `louder` than by this factor; the model is adequate then if its free runs stay within `agrees` times the
    noise floor, too. Where nothing can be named, a model whose free runs leave no more than `within` times the floor, which is
    not known better than that, is no unknown one.
    """

    largest_set: int = 3
    shortlist: int = 8
    singles: int = 5
    additions: int = 3
    extended: int = 2
    likeliest: int = 4
    rounds: int = 4
    most_effects: int = 4
    most_parameters: int = 12
    most_work: float = 4e9
    by_chance: float = 1e-3
    hopeless: float = 5.0
    standard_errors: float = 1.64
    nats: float = 3.0
    least_share: float = 0.1
    least_power: float = 0.003
    least_improvement: float = 0.3
    least_explained: float = 0.1
    complete_share: float = 0.1
    rare_share: float = 0.01
    surprising: float = 3.0
    defeated: float = 0.2
    worse: float = 0.02
    predictable: float = 0.3
    alike: float = 0.15
    quiet: float = 5.0
    louder: float = 1.05
    agrees: float = 1.5
    within: float = 1.2
