"""The effect catalogue: one page for each effect id, made from its cards, their Modelica classes and their pictures."""

import html
import re
from collections.abc import Mapping, Sequence
from functools import cache

from docs.generator.class_text import ClassText, read_class, slots_of
from docs.generator.scenes import Scene, scenes
from docs.generator.signature_cache import Parameter, Shown
from fmus.catalogue import built_in_models
from orchestrator.library.cards import CardParameter, EffectCard
from orchestrator.library.needs import Need

PLACES = {
    "": "",
    "joint": "At a joint",
    "slide": "On a slide",
    "level": "Of a level sensor",
    "drive": "Of a drive",
    "inflow": "Of a pump",
    "above": "Above an angle",
    "below": "Below an angle",
    "sigmoid": "S-shaped",
}
ELEMENTS = {
    "together": "all joints, muscles or channels of the part at once",
    "each": "one joint, muscle or sensor at a time",
    "pairs": "one pair of channels at a time",
}


@cache
def by_id() -> dict[str, list[Scene]]:
    """The cards of each effect id; the one without a variant comes first."""
    found: dict[str, list[Scene]] = {}
    for scene in sorted(scenes(), key=lambda scene: (scene.card.id, scene.card.variant)):
        found.setdefault(scene.card.id, []).append(scene)
    return found


def in_words(effect_id: str) -> str:
    """An effect's id as a heading."""
    return effect_id.replace("_", " ").capitalize()


def index_page() -> str:
    """The table of all effects."""
    rows = [
        f"| [{in_words(effect)}]({effect}.md) | {'<br>'.join(s.card.title for s in shown)} | {_confused(shown, '.md')} |"
        for effect, shown in by_id().items()
    ]
    return "\n".join([_INTRODUCTION.format(ids=len(rows), cards=len(scenes())), *rows, ""])


_INTRODUCTION = """# Effects

`misfit diagnose` can name {ids} effects, in {cards} variants. Each page shows the law, its parameters, a picture of what the
effect does, what it is taken for, and the experiment that shows it. The pages are made from the effect cards and the Modelica
classes whenever this site is built.

* Your effect is missing? [Write a card](../effect_cards.md).
* Two effects are confused? [Tell them apart](../how_to/tell_effects_apart.md).
* What a result says about the evidence: [What a diagnosis says](../evidence.md).

| effect | what it is | may be taken for |
|---|---|---|"""


def effect_page(effect: str, cards: Sequence[Scene], shown: Mapping[str, Shown]) -> str:
    """The page of an effect id, with a section for each of its cards."""
    several = len(cards) > 1
    parts = [f"# {in_words(effect)}", f"Name in results: `{effect}`."]
    for scene in cards:
        if several:
            parts.append(f"## {_place(scene.card)}")
        parts += _section(scene, shown[scene.name], "###" if several else "##")
    return "\n\n".join(parts) + "\n"


def _place(card: EffectCard) -> str:
    if card.variant:
        return PLACES.get(card.variant, card.variant.capitalize())
    return {"joint": "At a joint", "wrist": "At the wrist", "muscle": "Of the muscles"}.get(
        card.site, "Of an encoder" if card.site.startswith("sensor") else "As a law of its own"
    )


def _section(scene: Scene, shown: Shown, level: str) -> list[str]:
    card, text = scene.card, read_class(scene.card.class_name)
    return [
        f"{card.title}.",
        f"{level} Equation {{: #{scene.name}-equation }}",
        f"<p>{text.law}</p>",
        _modelica(card, text),
        f"{level} Parameters {{: #{scene.name}-parameters }}",
        _parameters(card, shown.parameters),
        f"{level} Signature {{: #{scene.name}-signature }}",
        _signature(scene, shown),
        f"{level} What confuses it {{: #{scene.name}-confused }}",
        _confusion(card),
        f"{level} Experiment that shows it {{: #{scene.name}-experiment }}",
        f"{card.experiment[:1].upper()}{card.experiment[1:]}.",
        _needs(card.needs),
        f"{level} Where it can be {{: #{scene.name}-sites }}",
        _sites(card),
        *([f"{level} Limits and source {{: #{scene.name}-source }}"] if text.remarks else []),
        *(f"<p>{paragraph}</p>" for paragraph in text.remarks),
    ]


def _modelica(card: EffectCard, text: ClassText) -> str:
    code = "\n".join(f"    {line}" for line in text.equations.splitlines())
    stated = "" if text.equations_of == card.class_name else f", stated in `{text.equations_of}`"
    return f'??? note "The equations in Modelica: `{card.class_name}`{stated}"\n\n    ```modelica\n{code}\n    ```'


def _parameters(card: EffectCard, declared: Sequence[Parameter]) -> str:
    classes = {parameter.name: parameter for parameter in declared}
    rows = [_row(parameter, classes[parameter.name]) for parameter in card.parameters]
    head = "| parameter | meaning | unit | bounds | first guess | absent at | smallest size that matters |"
    return "\n".join([head, "|---|---|---|---|---|---|---|", *rows])


def _row(parameter: CardParameter, declared: Parameter) -> str:
    low, high = ("-" if bound is None else f"{bound:g}" for bound in (declared.minimum, declared.maximum))
    size = "gives no size" if parameter.meaningful == float("inf") else f"{parameter.meaningful:g}"
    first = "frequency of the largest residual" if parameter.start_from else f"{parameter.start:g}"
    first = f"best of {', '.join(f'{value:g}' for value in parameter.grid)}" if parameter.grid else first
    meaning = html.escape(declared.description)
    return f"| `{parameter.name}` | {meaning} | {declared.unit} | {low} to {high} | {first} | {parameter.absent:g} | {size} |"


def _signature(scene: Scene, shown: Shown) -> str:
    units = {parameter.name: parameter.unit for parameter in shown.parameters}
    values = ", ".join(
        f"{name} = {value:g} {_unit(units[name.split('[')[0]])}".rstrip() for name, value in shown.values.items()
    )
    plant = scene.plant
    caption = (
        f"Built-in model `{plant.model}`, driven by {plant.manoeuvre}, with {values}. Left: how much the effect changes"
        f" `{scene.signal}`. Middle: the {plant.force} that the model without the effect lacks to follow. Right: the same"
        f" against {scene.against.replace('position', 'the position')}."
    )
    remark = f"\n\n{scene.remark}" if scene.remark else ""
    return f"![{html.escape(shown.alt)}](img/{scene.name}.png)\n\n{caption}{remark}"


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def _confusion(card: EffectCard) -> str:
    others = dict.fromkeys((*card.confusable, *_taken_for(card)))
    if not others:
        return (
            "No effect is known to look like it in general. What can be told apart depends on the data, so a diagnosis"
            " compares all effects on yours and lists those that it cannot separate."
        )
    listed = "\n".join(f"* [{in_words(other)}]({other}.md)" for other in others)
    return f"{listed}\n\nWhether your data separate them, a diagnosis says under `confusable` and `odds`."


def _taken_for(card: EffectCard) -> list[str]:
    """Effects whose own cards say that they may be taken for this one, in a model that can hold both."""
    return [
        effect
        for effect, cards in by_id().items()
        if effect != card.id and any(card.id in s.card.confusable and _share_a_model(s.card, card) for s in cards)
    ]


def _share_a_model(one: EffectCard, other: EffectCard) -> bool:
    slots = (slots_of(model.class_name) for model in built_in_models().values())
    return any(found & set(one.slots) and found & set(other.slots) for found in slots)


def _confused(cards: Sequence[Scene], ending: str) -> str:
    names = dict.fromkeys(name for scene in cards for name in scene.card.confusable)
    return ", ".join(f"[{in_words(name)}]({name}{ending})" for name in names) or "-"


def _needs(needs: Sequence[Need]) -> str:
    if not needs:
        return "The card asks for no particular motion."
    return "The data must contain:\n\n" + "\n".join(f"* {_need(need)}" for need in needs)


def _need(need: Need) -> str:
    limit = f"`{need.limit}`" if isinstance(need.limit, str) else f"{need.limit:g}"
    what = f"{need.what} (`{need.variable}`)"
    return {
        "reversals": f"at least {need.wanted:g} changes of sign of the {what}",
        "spread": f"a range of the {what} of at least {need.wanted:g}",
        "within": f"{need.wanted:g} samples with the size of the {what} below {limit}",
        "beyond": f"{need.wanted:g} samples with the size of the {what} above {limit}",
        "below": f"{need.wanted:g} samples with the {what} below {limit}",
        "above": f"{need.wanted:g} samples with the {what} above {limit}",
    }[need.kind]


def _sites(card: EffectCard) -> str:
    slots = ", ".join(f"`{slot}`" for slot in card.slots)
    models = [name for name, model in built_in_models().items() if slots_of(model.class_name) & set(card.slots)]
    return (
        f"Slots: {slots}. Built-in models with such a slot: {', '.join(f'`{name}`' for name in models)}."
        f" It is fitted for {ELEMENTS[card.elements]}; results write its site after the pattern `{card.site}`."
    )


def plain(text: str) -> str:
    """A paragraph of documentation without its tags."""
    return html.unescape(re.sub(r"<[^>]+>", "", text))
