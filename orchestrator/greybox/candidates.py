"""Candidates: laws at places of a model, with shapes in the scale of the record."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

from orchestrator.greybox.laws import Law, LawParameter
from orchestrator.greybox.places import Place

# Standard deviation of the logarithm of how sharp a corner is, about the law's grid: friction may well be seven times as sharp.
SHARPNESS = 2.0
# A corner is no wider than this share of the record's scale: friction that grows over all speeds is viscous.
BLUNTEST = 0.2
# Standard deviations of an input's noise that a threshold is above.
NOISE = 3.0


@dataclass(frozen=True)
class Candidate:
    """A law at a place; `shapes` are first values of its shape parameters, and of gains that do not begin at zero; `number`
    tells its grid variants apart.

    A `rare` one is tried only where the others do not explain the record.
    """

    law: Law
    place: Place
    shapes: Mapping[str, float] = field(default_factory=dict)
    number: int = 0
    rare: bool = False

    @property
    def id(self) -> str:
        """Id of the effect at this place."""
        return self.law.id_at(self.place.unit)

    @property
    def name(self) -> str:
        """The id, with the variant if the law has one."""
        return f"{self.id} {self.law.variant}".rstrip()

    @property
    def family(self) -> tuple[str, str]:
        """What the candidates of one law at one place have in common, whatever their first values."""
        return self.name, self.place.site

    @property
    def label(self) -> str:
        """Short name for progress and messages."""
        return f"{self.name} at {self.place.site}"

    def is_apart_from(self, other: "Candidate") -> bool:
        """Whether both can be in one set: they are not one effect at one place, and none contains the other."""
        if self.place.site != other.place.site:
            return True
        return self.name != other.name and self.name not in other.law.contains and other.name not in self.law.contains

    def begun_with(self, values: Mapping[str, float]) -> "Candidate":
        """The candidate with first values of those of its parameters that are among `values`."""
        own = {p.name: values[p.name] for p in self.law.parameters if p.name in values}
        return replace(self, shapes={**self.shapes, **own})

    def symbol(self, parameter: LawParameter) -> str:
        """Name of a parameter in the extended system."""
        return f"{self.law.id}@{self.place.site}#{self.number}.{parameter.name}"

    def state_symbol(self, state: str) -> str:
        """Name of a state of the law in the extended system."""
        return f"{self.label}#{self.number}.{state}"

    def spread(self, parameter: LawParameter) -> float:
        """Standard deviation of a parameter's prior, without end for a gain unless the law says so; of the logarithm for one that smooths."""
        if parameter.gain:
            return parameter.prior or math.inf
        if parameter.kind.startswith("centre"):
            return self.place.range[1]
        if parameter.smooths:
            return SHARPNESS
        return abs(self.shapes[parameter.name]) or 1.0

    def limits(self, parameter: LawParameter) -> tuple[float, float]:
        """Between which values physics allows a parameter here."""
        if parameter.along:
            return (0.0, math.inf) if self.place.sign > 0 else (-math.inf, 0.0)
        most = BLUNTEST * parameter.scale(self.place.scales) if parameter.smooths else parameter.most
        return _least(parameter, self.place), most

    @property
    def gains(self) -> tuple[LawParameter, ...]:
        """Parameters that enter linearly."""
        return tuple(p for p in self.law.parameters if p.gain)

    @property
    def shares(self) -> dict[str, float]:
        """Gains that say in which share a law acts, with the whole of it."""
        return {p.name: p.most for p in self.gains if p.most == 1.0}

    @property
    def fitted_shapes(self) -> tuple[LawParameter, ...]:
        """Shape parameters that are estimated."""
        return tuple(p for p in self.law.parameters if not p.gain and p.fitted)


def candidates_at(places: Sequence[Place], laws: Sequence[Law]) -> list[Candidate]:
    """Every law at every place that it fits, once for each point of its grid of shapes.

    What changes a force before it acts is rare: a dead zone of a motor looks like the dry friction that every motor has.
    """
    # A wrong gain or zero of an input that is itself a force on something that moves is, in other words, an effect there.
    forces = {place.unit for place in places if place.balance is not None and place.kind == "motion"}
    stores = any(place.kind == "storage" for place in places)
    laws = [law for law in laws if stores or not law.slow]
    pairs = [(place, law) for place in places for law in laws if fits(law, place)]
    return [
        candidate
        for place, law in pairs
        if not (law.id in ("input_offset", "input_gain") and place.unit in forces)
        for candidate in _variants(
            law, place.widened(law.also), law.rare or (place.kind == "input" and place.unit in forces)
        )
    ]


def fits(law: Law, place: Place) -> bool:
    """Whether a law can act at a place."""
    if law.bounded and place.turns:  # a shaft that turns freely has no spring and no stop
        return False
    if any(name not in place.others for name in law.also.values()):
        return False
    # Of a speed alone there is no position, and what flows into nothing that is stored is not known.
    known = {*place.coordinates, *place.units} | ({"net"} if place.storage is not None else set())
    if not law.asks_for <= known:
        return False
    if place.is_potential and "x" not in law.asks_for:  # what does not go with the potential acts at the store
        return False
    between = place.balance is None and place.kind in ("motion", "storage")
    if between and (law.single or "net" in law.asks_for):
        return False
    own = {place.unit, place.units.get("position", place.unit)}
    return (law.place == place.kind or (between and law.place == f"between_{place.kind}s")) and (
        not law.units or not own.isdisjoint(law.units)
    )


def _variants(law: Law, place: Place, rare: bool) -> Iterator[Candidate]:
    shaped = [p for p in law.parameters if not p.gain]
    for number, factors in enumerate(product(*(p.grid or (1.0,) for p in shaped))):
        values = {p.name: _value(p, factor, place) for p, factor in zip(shaped, factors, strict=True)}
        values |= {p.name: p.value for p in shaped if math.isfinite(p.value)}
        if all(values[p.name] >= _least(p, place) for p in shaped):
            yield Candidate(law, place, values, number, rare)


def _least(parameter: LawParameter, place: Place) -> float:
    """The least value of a parameter. Fewer waves than a law asks for are like a spring, and a threshold within the noise of an
    input's sensor takes noise away."""
    if parameter.waves:
        return math.pi * parameter.waves / max(place.range[1], 1e-300)
    if parameter.beyond_noise and place.noise > 0:
        return NOISE * place.noise
    return 0.0 if parameter.positive else -math.inf


def _value(parameter: LawParameter, factor: float, place: Place) -> float:
    """A grid point in the place's own scale; a `centre` is a position within the range of what was seen."""
    if parameter.kind.startswith("centre"):
        centre, half = place.range
        return centre + factor * half
    return factor * parameter.scale(place.scales)


def numbered(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """The same candidates with numbers of their own, so that one system can hold them all."""
    return tuple(replace(c, number=k) for k, c in enumerate(candidates))
