"""Terms of formulas: products of factors, and laws as sums of terms, each constant with the unit that its term asks for."""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

from orchestrator.greybox.candidates import Candidate
from orchestrator.greybox.expression import renamed
from orchestrator.greybox.laws import Law, LawParameter
from orchestrator.greybox.places import Place
from orchestrator.laws.vocabulary import OF, Factor, factors


@dataclass(frozen=True)
class Term:
    """A factor, alone or times a modulator; `of` is the coordinate of a further variable that one of them speaks of."""

    carrier: Factor
    modulator: Factor | None = None
    of: str = ""

    @property
    def id(self) -> str:
        """Name by its factors."""
        parts = [self.carrier.id, *([self.modulator.id] if self.modulator else []), *([self.of] if self.of else [])]
        return "_".join(parts)

    @property
    def library(self) -> str:
        """Id of the shipped law that the term is, empty if it is none."""
        return "" if self.modulator else self.carrier.library

    @property
    def factors(self) -> tuple[Factor, ...]:
        """One or two."""
        return (self.carrier,) if self.modulator is None else (self.carrier, self.modulator)

    @property
    def brakes(self) -> bool:
        """Whether a positive gain takes from its balance; what comes from elsewhere adds to it."""
        return self.carrier not in (*factors("free"), *factors("further"))

    @property
    def cost(self) -> int:
        """Number of constants, held ones not counted."""
        return 1 + sum(p.fitted for f in self.factors for p in f.shapes)


def terms_at(place: Place, further: Sequence[str]) -> list[Term]:
    """Every term of the vocabulary at a place, with further variables by their coordinates."""
    moves = place.kind == "motion"
    placed = moves and "position" in place.units
    # What follows an input's position has no speed: how fast the input moves is not known.
    own = list(factors("state")) if not moves else list(factors("speed")) if "speed" in place.units else []
    own += factors("position") if placed and not place.turns else []
    alone = [Term(f) for f in (*own, *factors("free"))]
    alone += [Term(f, None, of) for f in factors("further") for of in further]
    heavy = [term for term in alone if term.carrier.weighs]
    held = [term for term in heavy if not term.of and term.carrier not in factors("free")]
    fast = [term for term in held if term.carrier in factors("speed")]
    loads = [Term(f) for f in factors("inertia")] if place.storage is not None else []
    about = {"by_time": [*heavy, *loads], "by_memory" if moves else "by_state_memory": fast if moves else held}
    if placed and not place.turns:
        about["by_position"] = [*fast, *(term for term in heavy if term.of)]
    if not moves:
        # What begins at a value by itself is not switched by another one.
        steady = [
            term for term in alone if term.carrier in (*factors("state"), *factors("free")) and not term.carrier.shapes
        ]
        about["by_state"] = [term for term in steady if term.carrier.weighs]
    found = alone
    for group, carriers in about.items():
        found += [replace(term, modulator=m) for term in carriers for m in factors(group)]
    for group in ("by_further", "by_further_memory"):
        found += [replace(term, modulator=m, of=of) for term in held for m in factors(group) for of in further]
    found = [term for term in found if sum(bool(f.states) for f in term.factors) < 2]  # their names are the same
    if moves and not placed:
        return [term for term in found if not any(_asks_for_a_position(f) for f in term.factors)]
    return found


def _asks_for_a_position(factor: Factor) -> bool:
    """Whether a factor has a constant that is measured by positions, such as the way over which friction builds up."""
    kinds = " ".join((*factor.powers, *(p.kind for p in factor.shapes)))
    return re.search(r"\bposition\b", kinds) is not None


def modulators_of_several(terms: Sequence[Term]) -> set[str]:
    """Ids of modulators with constants that more than one term has, those of further variables left out."""
    ids = [term.modulator.id for term in terms if term.modulator and term.modulator.shapes]
    return {each for each in ids if ids.count(each) > 1 and each not in {f.id for f in factors("by_further_memory")}}


def law_of(terms: Sequence[Term], place: Place, *, shared: bool = False) -> Law:
    """The law that is a sum of terms; names of their constants get numbers if there is more than one term.

    Args:
        terms: what is summed.
        place: where it acts.
        shared: whether a modulator of several terms has the same constants in all of them.
    """
    common = modulators_of_several(terms) if shared else set()
    own = "v" if place.kind == "motion" else "x"
    texts: list[str] = []
    loads: list[str] = []
    pushes: list[str] = []
    parameters: list[LawParameter] = []
    states: dict[str, str] = {}
    for number, term in enumerate(terms, start=1):
        end = str(number) if len(terms) > 1 else ""
        ended = [(f, "" if f is term.modulator and f.id in common else end) for f in term.factors]
        names = {p.name: p.name + last for f, last in ended for p in f.shapes}
        names |= {s: s + last for f, last in ended for s in f.states} | ({OF: term.of} if term.of else {})
        gain = LawParameter(f"k{end}", _kind(term, place), gain=True, description=_describe(term))
        shapes = [replace(p, name=names[p.name], kind=_of(p.kind, term)) for f in term.factors for p in f.shapes]
        parameters += [gain, *(p for p in shapes if p.name not in {known.name for known in parameters})]
        sign = "-" if term.brakes else ""
        shares = [gain.name, *(renamed(f.text, names) for f in term.factors if f.text != "1")]
        texts.append(sign + "*".join(shares).replace("(own)", f"({own})"))
        if term.carrier in factors("inertia"):
            loads.append("*".join(share for share in shares if not share.startswith("der(")))
        else:
            pushes.append(texts[-1])
        for f in term.factors:
            states |= {names[s]: renamed(rate, names) for s, rate in f.states.items()}
    text, written = _sum(texts), ""
    if loads:
        # What pushes the model's own storage is shared with what was added to it.
        written, added = text, " + ".join(loads)
        text = f"(storage*({_sum(pushes) or 0}) - ({added})*net)/(storage + {added})"
    name = "_and_".join(term.id for term in terms)
    law = Law(name, _title(terms), place.kind, text, tuple(parameters), states=states)  # type: ignore[arg-type]
    return replace(law, curved=bool(loads), written=written)


def _sum(texts: Sequence[str]) -> str:
    return "".join(texts[:1]) + "".join(f" {t[0]} {t[1:]}" if t.startswith("-") else f" + {t}" for t in texts[1:])


def _kind(term: Term, place: Place) -> str:
    """`force/speed/position^2`, for the gain of a term."""
    powers: dict[str, int] = {}
    for f in term.factors:
        for name, power in f.powers.items():
            powers[name] = powers.get(name, 0) + power
    means = {OF: term.of, "own": "speed" if place.kind == "motion" else "state"}
    named = {means.get(name, name): power for name, power in powers.items()}
    return "/".join(["force", *(name if power == 1 else f"{name}^{power}" for name, power in named.items())])


def _of(kind: str, term: Term) -> str:
    """The kind of a shape, with the further variable that a term speaks of."""
    return re.sub(rf"\b{OF}\b", term.of, kind) if term.of else kind


def _describe(term: Term) -> str:
    return f"size of: {plain_words(term)}"


def plain_words(term: Term) -> str:
    """What a term is, in words without values."""
    words = " ".join(f.words for f in term.factors).replace("{of}", term.of)
    return re.sub(r" ?\{\w+\}", " some value", re.sub(r" \(\{\w+\}\)", "", words))


def _title(terms: Sequence[Term]) -> str:
    return ", and ".join(plain_words(term) for term in terms)


def variants(law: Law, place: Place) -> Iterator[Candidate]:
    """A law with each point of its grid of shapes."""
    shaped = [p for p in law.parameters if not p.gain]
    for factors_ in product(*(p.grid for p in shaped)):
        yield Candidate(law, place, {p.name: value_at(p, f, place) for p, f in zip(shaped, factors_, strict=True)})


def nearby(candidate: Candidate, reach: float) -> Iterator[Candidate]:
    """A candidate with each fitted shape as it is and to both sides: by a factor of 2 to the power `reach`, a centre by `reach`
    times a seventh of half the range that was seen."""
    moved = {}
    for p in candidate.fitted_shapes:
        value = candidate.shapes[p.name]
        step = reach * candidate.place.range[1] / 7
        sides = (value - step, value + step) if p.kind.startswith("centre") else (value / 2**reach, value * 2**reach)
        moved[p.name] = (value, *sides)
    for values in product(*moved.values()):
        yield replace(candidate, shapes={**candidate.shapes, **dict(zip(moved, values, strict=True))})


def with_other_held(candidate: Candidate) -> Iterator[Candidate]:
    """A candidate with each other value that the vocabulary has for a shape that is held."""
    for p in candidate.law.parameters:
        if not (p.gain or p.fitted):
            values = (value_at(p, share, candidate.place) for share in p.grid)
            yield from (
                replace(candidate, shapes={**candidate.shapes, p.name: value})
                for value in values
                if not math.isclose(value, candidate.shapes[p.name], rel_tol=0.5)
            )


def value_at(parameter: LawParameter, share: float, place: Place) -> float:
    """A grid point in the place's own scale; a `centre` is a position within the range of what was seen.

    Args:
        parameter: the parameter.
        share: the grid point, in scales of the place.
        place: where the law acts.
    """
    if parameter.kind.startswith("centre"):
        return place.range[0] + share * place.range[1]
    return share * parameter.scale(place.scales)


def joined(parts: Sequence[tuple[Term, Candidate]], place: Place) -> Candidate:
    """The sum of terms, each with the shapes that it has alone."""
    law = law_of([term for term, _ in parts], place)
    shapes: dict[str, float] = {}
    for number, (_, alone) in enumerate(parts, start=1):
        end = str(number) if len(parts) > 1 else ""
        shapes |= {name + end: value for name, value in alone.shapes.items()}
    return Candidate(law, place, shapes)
