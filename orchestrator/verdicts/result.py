"""What a diagnosis found: a verdict, the effects it names, and the evidence."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, Literal, Protocol

from orchestrator.compare.result import Comparison
from orchestrator.datacheck.findings import Finding
from orchestrator.shown import Shown, drawing_of
from orchestrator.verdicts.latent_force import LatentForce
from orchestrator.verdicts.open_questions import CollinearPair, Coverage, Doubt

CURVE_SAMPLES = 400

# A note of searches that end by the work they took.
LEFT_UNTRIED = (
    "the search ended before all sets of effects were tried, since runs of this model take long: thin the record out or shorten"
    " it to try more"
)

Verdict = Literal["adequate", "named", "ambiguous", "unknown", "cannot_tell"]


@dataclass(frozen=True)
class Estimate:
    """A fitted parameter with its 90 % confidence interval."""

    value: float
    unit: str
    ci90: tuple[float, float]


@dataclass(frozen=True)
class Adjusted:
    """A parameter of the model that was fitted within its stated tolerance: `nominal` and fitted, in `unit`."""

    name: str
    nominal: float
    fitted: Estimate

    def __str__(self) -> str:
        """Name, change as a share, fitted value with unit."""
        return f"{self.name} {self.share:+.2%} to {self.fitted.value:.4g} {self.fitted.unit}".rstrip()

    @property
    def share(self) -> float:
        """The change as a share of the nominal value."""
        return self.fitted.value / self.nominal - 1.0

    def as_effect(self) -> "NamedEffect":
        """The change as the effect of a wrong parameter, by its share of the nominal value."""
        low, high = sorted(value / self.nominal - 1.0 for value in self.fitted.ci90)
        return NamedEffect("parameter_error", self.name, {"share": Estimate(self.share, "1", (low, high))})


@dataclass(frozen=True)
class NamedEffect:
    """An effect at a site, with its fitted parameters by name, and which of several cards of this id it is."""

    id: str
    site: str
    parameters: Mapping[str, Estimate]
    variant: str = ""

    @staticmethod
    def of(document: Mapping[str, Any]) -> "NamedEffect":
        """The effect that a JSON document holds.

        Raises:
            KeyError, TypeError, ValueError: if it holds none.
        """
        parameters = {}
        for name, entry in document["parameters"].items():
            low, high = entry["ci90"]
            parameters[name] = Estimate(float(entry["value"]), str(entry["unit"]), (float(low), float(high)))
        return NamedEffect(str(document["id"]), str(document["site"]), parameters, str(document.get("variant", "")))


@dataclass(frozen=True)
class RankedSet:
    """A set of effects that was tried; `score` is the share of what the model as given lacks that it explains."""

    effects: tuple[str, ...]
    sites: tuple[str, ...]
    score: float
    probability: float


@dataclass(frozen=True)
class Odds:
    """Odds of a named effect against another in its place, by learning and held-out trials."""

    named: str
    rival: str
    odds: float

    def __str__(self) -> str:
        """The odds as a sentence."""
        return f"{self.named} or {self.rival}: odds {self.odds:.3g} to 1"


@dataclass(frozen=True)
class Tried:
    """A set of effects that was tried, and what became of it in words."""

    effects: tuple[str, ...]
    sites: tuple[str, ...]
    outcome: str


@dataclass(frozen=True)
class Step:
    """One model on the way from the nominal to the named one, with its comparison.

    `adjusted` are the parameters of the model itself that were fitted within stated tolerances together with the effects.
    """

    effects: tuple[NamedEffect, ...]
    comparison: Comparison
    adjusted: tuple[Adjusted, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Plain values, without curves."""
        errors = self.comparison.to_json()
        return {
            "effects": [asdict(effect) for effect in self.effects],
            "adjusted": [asdict(entry) for entry in self.adjusted],
            **{key: errors[key] for key in ("noise_floor", "learning", "held_out", "trials")},
        }


def reducible_removed(before: float, after: float) -> float:
    """Share of the error above the floor that is gone, at most 1, and 0 if none was above it; errors are multiples of the floor.

    >>> reducible_removed(11.0, 2.0), reducible_removed(11.0, 0.9), reducible_removed(0.8, 0.1)
    (0.9, 1.0, 0.0)
    """
    return min((before - after) / (before - 1.0), 1.0) if before > 1.0 else 0.0


@dataclass(frozen=True)
class HeldOut:
    """Free-run error of the held-out trials by signal, before and after, and the floor; `reducible_removed` as below, on root
    mean squares over signals of rmse / floor."""

    rmse_before: Mapping[str, float]
    rmse_after: Mapping[str, float]
    noise_floor: Mapping[str, float]
    reducible_removed: float


class Law(Protocol):
    """A proposed formula: what stands in a document of it, and what a report says of it."""

    @property
    def sentence(self) -> str: ...

    @property
    def formula(self) -> str: ...

    def to_json(self) -> dict[str, Any]: ...


@dataclass(frozen=True)
class Diagnosis:
    """Verdict and evidence of `misfit diagnose`. `steps` begins with the model as given.

    `latent_forces` are curves of what no effect explains, for the verdict "unknown". `experiment_csv` is the table of
    inputs of the next experiment. `where` maps the force that the model as given lacks (rows as in a comparison's
    "state"), `findings` says the same. `tried` tells what became of each set of the ranking. `adjusted` are the
    parameters fitted within their tolerances and `clock_shift_s` by how much outputs were late; errors count with both,
    the patched model has neither. `data_checks` says what is wrong with the record, `mended` what was mended before;
    `libraries` are the folders in which Modelica classes were looked for, `model_file` is a model of the user's own as
    FILE.mo:CLASS, `interpolation` how inputs ran between samples ("hold" or "linear", by column): an error is one figure
    only along the same inputs. `incomplete` says that `unexplained_share` of the missing force's power is left, `best` is
    the best set of an answer that is not proven, `witness` the missing force over its best coordinate with the fitted law. `laws` are formulas proposed where no card fits; `search` is
    what a further search can go on from, and stands in no document.
    """

    model: str
    data: str
    verdict: Verdict
    effects: tuple[NamedEffect, ...]
    confusable: tuple[tuple[str, ...], ...]
    ranking: tuple[RankedSet, ...]
    p_value: float | None
    noise_floor: Mapping[str, float]
    held_out: HeldOut
    warnings: tuple[str, ...]
    next_experiment: Mapping[str, Any] | None
    patched_model: str | None
    seconds: float
    steps: tuple[Step, ...]
    latent_forces: tuple[LatentForce, ...] = ()
    experiment_csv: str | None = None
    where: tuple[Mapping[str, Any], ...] = ()
    findings: tuple[str, ...] = ()
    tried: tuple[Tried, ...] = ()
    adjusted: tuple[Adjusted, ...] = ()
    clock_shift_s: float = 0.0
    odds: tuple[Odds, ...] = ()
    identifiability: tuple[Doubt, ...] = ()
    excitation: tuple[Coverage, ...] = ()
    kin: tuple[CollinearPair, ...] = ()
    data_checks: tuple[Finding, ...] = ()
    mended: tuple[str, ...] = ()
    libraries: tuple[str, ...] = ()
    incomplete: bool = False
    unexplained_share: float | None = None
    best: tuple[NamedEffect, ...] = ()
    witness: tuple[Mapping[str, Any], ...] = ()
    laws: tuple["Law", ...] = ()
    functions: tuple[Mapping[str, Any], ...] = ()
    model_file: str = ""
    interpolation: Mapping[str, str] = field(default_factory=dict)
    search: Any = field(default=None, repr=False, compare=False)

    def __getstate__(self) -> dict[str, Any]:
        # Machine code of the search stays in its process.
        return {**self.__dict__, "search": None}

    def plot(self) -> Shown:
        """The error that falls from step to step, for a notebook; the ranking where no effect was added."""
        return drawing_of("diagnosis").plot(self)

    def _repr_html_(self) -> str:
        return drawing_of("diagnosis").html(self)

    def to_json(self) -> dict[str, Any]:
        """Return the `misfit.diagnosis/1` document."""
        return {
            "schema": "misfit.diagnosis/1",
            "model": self.model,
            "data": self.data,
            "verdict": self.verdict,
            "incomplete": self.incomplete,
            "unexplained_share": self.unexplained_share,
            "effects": [asdict(effect) for effect in self.effects],
            "best": [asdict(effect) for effect in self.best],
            "witness": [dict(picture) for picture in self.witness],
            "confusable": [list(group) for group in self.confusable],
            "odds": [asdict(entry) for entry in self.odds],
            "ranking": [asdict(entry) for entry in self.ranking],
            "none_of_these": max(0.0, 1.0 - sum(entry.probability for entry in self.ranking)),
            "p_value": self.p_value,
            "noise_floor": dict(self.noise_floor),
            "held_out": asdict(self.held_out),
            "nuisances": {
                "parameters": [asdict(entry) for entry in self.adjusted],
                "clock_shift_s": self.clock_shift_s,
                "in_patched_model": len(self.steps) > 1,
            },
            "warnings": list(self.warnings),
            "identifiability": [entry.to_json() for entry in self.identifiability],
            "kin": [entry.to_json() for entry in self.kin],
            "excitation": [entry.to_json() for entry in self.excitation],
            "next_experiment": self.next_experiment,
            "patched_model": self.patched_model,
            "seconds": self.seconds,
            "steps": [step.to_json() for step in self.steps],
            "where": {"force": [dict(row) for row in self.where], **self.steps[0].comparison.where},
            "findings": list(self.findings),
            "tried": [asdict(entry) for entry in self.tried],
            "curves": [curve for step in self.steps[-1:] for curve in _held_out_curves(self.steps[0], step)],
            "latent_forces": [curve.to_json() for curve in self.latent_forces],
            "data_checks": [finding.to_json() for finding in self.data_checks],
            "mended": list(self.mended),
            "laws": [law.to_json() for law in self.laws],
            "libraries": list(self.libraries),
            "functions": [dict(row) for row in self.functions],
            "model_file": self.model_file,
            "interpolation": dict(self.interpolation),
        }


def _held_out_curves(given: Step, final: Step) -> list[dict[str, Any]]:
    """Measured and modelled curves of the held-out trials, before and after, at most `CURVE_SAMPLES` samples each."""
    after = {(c.file, c.set): c for c in final.comparison.curves}
    found = []
    for curve in given.comparison.curves:
        if curve.set != "held_out" or (curve.file, curve.set) not in after:
            continue
        part = slice(None, None, max(1, -(-len(curve.time) // CURVE_SAMPLES)))
        then = after[curve.file, curve.set]
        signals = {
            name: {
                "unit": given.comparison.units[name],
                "noise_floor": given.comparison.noise_floor[name],
                "measured": curve.measured[name][part].tolist(),
                "before": curve.modelled[name][part].tolist(),
                "after": then.modelled[name][part].tolist(),
            }
            for name in curve.measured
        }
        found.append({"file": curve.file, "time_s": curve.time[part].tolist(), "signals": signals})
    return found
