"""The files of a proposed law: its card (TOML), a Modelica class with documentation, and a picture of the law over the data."""

import json
from collections.abc import Mapping
from dataclasses import replace
from html import escape
from pathlib import Path

from fmus.files import write_atomically
from orchestrator.greybox.expression import renamed
from orchestrator.greybox.laws import Law, LawParameter
from orchestrator.laws.picture import picture_of
from orchestrator.laws.proposal import LawProposal


def write_files(proposal: LawProposal, folder: Path) -> LawProposal:
    """Write card, class and picture; the proposal with their paths."""
    card, modelica, picture = (folder / f"{proposal.id}{end}" for end in (".toml", ".mo", ".svg"))
    write_atomically(card, card_text(proposal.law).encode())
    write_atomically(modelica, class_text(proposal).encode())
    drawn = picture_of(proposal)
    if drawn:
        write_atomically(picture, drawn)
    return replace(proposal, card=str(card), modelica=str(modelica), picture=str(picture) if drawn else "")


def card_text(law: Law) -> str:
    """The card of a law, which `read_law` reads back."""
    lines = [
        f"{key} = {json.dumps(value)}" for key, value in (("id", law.id), ("title", law.title), ("place", law.place))
    ]
    lines += [f"expression = {json.dumps(law.expression)}"]
    lines += [f"written = {json.dumps(law.written)}"] if law.written else []
    lines += [f"units = {json.dumps(list(law.units))}"]
    lines += [f"site = {json.dumps(law.site)}"]
    for table, entries in (("also", law.also), ("states", law.states)):
        if entries:
            lines += [f"[{table}]", *(f"{k} = {json.dumps(v)}" for k, v in entries.items())]
    lines += ["[seen]", *(f"{name} = [{low!r}, {high!r}]" for name, (low, high) in law.seen.items())]
    for parameter in law.parameters:
        lines += [f"[parameters.{parameter.name}]", *_parameter_lines(parameter)]
    for effect in law.beside:
        lines += ["[[beside]]", f"id = {json.dumps(effect['id'])}", f"site = {json.dumps(effect['site'])}"]
        for name, row in effect["parameters"].items():
            value, unit, (low, high) = float(row["value"]), json.dumps(row["unit"]), row["ci90"]
            lines += [f"[beside.parameters.{name}]", f"value = {value!r}", f"unit = {unit}"]
            lines += [f"ci90 = [{float(low)!r}, {float(high)!r}]"]
    return "\n".join(lines) + "\n"


def _parameter_lines(parameter: LawParameter) -> list[str]:
    lines = [f"kind = {json.dumps(parameter.kind)}", f"value = {float(parameter.value)!r}"]
    lines += [f"ci90 = {[float(end) for end in parameter.ci90]}"] if parameter.ci90 else []
    lines += ["gain = true"] if parameter.gain else [f"grid = {list(parameter.grid)}"]
    lines += [] if parameter.gain or parameter.fitted else ["fitted = false"]
    return [*lines, f"description = {json.dumps(parameter.description)}"]


def class_text(proposal: LawProposal) -> str:
    """A Modelica block of the law: coordinates in, force out, its documentation saying where it was seen."""
    law = proposal.law
    names = {variable: key for key, variable in _names(proposal).items()}
    inputs = {names[v]: unit for v, unit in proposal.coordinates.items() if v != "time"}
    expression = renamed(law.written or law.expression, {"t": "time"})
    lines = [f'block {law.id} "{_plain(law.title)}"']
    lines += [f"  input Real {name}{_unit(unit)};" for name, unit in inputs.items()]
    for parameter in law.parameters:
        estimate = proposal.parameters[parameter.name]
        text = f"  parameter Real {parameter.name}{_unit(estimate.unit)} = {estimate.value!r}"
        lines.append(f'{text} "{_plain(parameter.description)}";')
    lines += [f'  output Real f{_unit(proposal.unit)} "what it adds to the balance at {proposal.site}";']
    lines += [f"  Real {state}(start=0, fixed=true);" for state in law.states]
    lines += ["equation", f"  f = {expression};"]
    lines += [f"  der({state}) = {renamed(rate, {'t': 'time'})};" for state, rate in law.states.items()]
    return (
        "\n".join([*lines, f'  annotation(Documentation(info="{_documentation(proposal)}"));', f"end {law.id};"]) + "\n"
    )


def _names(proposal: LawProposal) -> Mapping[str, str]:
    """Variables of the model by the coordinates of the law."""
    return dict(zip(proposal.law.seen, proposal.coordinates, strict=True))


def _documentation(proposal: LawProposal) -> str:
    rows = "".join(
        f"<li>{escape(name)}: {low:.4g} to {high:.4g} {escape(proposal.coordinates[name])}</li>"
        for name, (low, high) in proposal.seen.items()
    )
    constants = "".join(f"<li>{name} = {value.value:.4g} {escape(value.unit)} ({value.ci90[0]:.4g} to {value.ci90[1]:.4g})</li>" for name, value in proposal.parameters.items())  # fmt: skip
    errors = "; ".join(
        f"{escape(s)} {proposal.held_out_before[s]:.4g} -> {proposal.held_out_after[s]:.4g} {proposal.held_out_units.get(s, '')}".rstrip()
        for s in proposal.held_out_after
    )
    text = (
        f"<html><p>{escape(proposal.sentence)}: {escape(proposal.formula)}</p>"
        f"<p>Constants with 90 % intervals</p><ul>{constants}</ul><p>Seen for</p><ul>{rows}</ul>"
        "<p>Outside of these ranges the law is an extrapolation that no measurement supports.</p>"
        f"<p>Root mean square errors of held-out trials, before and after: {errors}.</p></html>"
    )
    return _plain(text)


def _plain(text: str) -> str:
    return text.replace("\\", "").replace('"', "'")


def _unit(unit: str) -> str:
    return f'(unit="{unit}")' if unit not in ("", "1") else ""
