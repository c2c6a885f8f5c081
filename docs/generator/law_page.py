"""The laws that are tried in a user's own model: one table for each kind of place, made from their cards."""

from collections.abc import Iterator

from orchestrator.greybox.laws import Law, laws

TITLES = {
    "motion": "At the balance of forces or torques on something that moves",
    "between_motions": "Between two things that move, or one and an input that moves",
    "storage": "At the balance of a store: heat, charge, volume, amount",
    "between_storages": "Between two stores, or a store and an input of its unit",
    "input": "At an input",
    "between_inputs": "From one input to another",
    "output": "At the sensor of an output",
    "response": "From an input to an output",
    "parameter": "At a parameter",
}
_INTRODUCTION = """# Laws for own models

What `misfit diagnose` tries in a model without slots, at every place that fits by its units. Coordinates: position `q`, speed `v`,
state `x`, input `u`, reading `y`, parameter `p`, time `t`, other flows into the balance `net`, the input that drives it `load`.
Laws with a star are tried only where the others leave something. [Write your own](../laws.md)."""


def law_page() -> str:
    """The page, as Markdown."""
    parts = [_INTRODUCTION]
    for place, title in TITLES.items():
        own = [law for law in laws() if law.place == place]
        rows = "\n".join(row for law in own for row in _rows(law))
        parts.append(f"## {title}\n\n| name in results | what it is | law | parameters |\n|---|---|---|---|\n{rows}")
    return "\n\n".join(parts) + "\n"


def _rows(law: Law) -> Iterator[str]:
    names = dict.fromkeys((law.id, *law.names.values()))
    states = "".join(f"<br>`der({state}) = {rate}`" for state, rate in law.states.items())
    parameters = "<br>".join(f"`{p.name}`: {p.description}" for p in law.parameters)
    star = " *" if law.rare else ""
    yield f"| {', '.join(f'`{name}`' for name in names)}{star} | {law.title} | `{law.expression}`{states} | {parameters} |"
