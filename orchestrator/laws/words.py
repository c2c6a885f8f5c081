"""Proposed laws as lines of text."""

from collections.abc import Sequence

from orchestrator.laws.proposal import LawProposal


def laws_text(proposals: Sequence[LawProposal]) -> str:
    """What to print of proposals; empty if there are none."""
    if not proposals:
        return ""
    first, *others = proposals
    lines = [
        f"a formula explains what the library's effects leave: {first.sentence}",
        f"  at {first.site}, in {first.unit}: {first.formula}",
    ]
    if first.beside:
        lines.append(f"  beside {' and '.join(f'{effect.id} at {effect.site}' for effect in first.beside)}")
    for name, value in first.parameters.items():
        unit = value.unit if value.unit != "1" else ""
        interval = f"[{value.ci90[0]:.4g}, {value.ci90[1]:.4g}]" if value.ci90[0] < value.ci90[1] else "held"
        lines.append(f"  {name} = {value.value:.4g} {unit} {interval}")
    for signal, after in first.held_out_after.items():
        errors = f"{first.held_out_before[signal]:.4g} -> {after:.4g} {first.held_out_units.get(signal, '')}"
        lines.append(f"  held-out error of {signal}: {errors.rstrip()}")
    lines += [f"  explains the record as well: {other.formula} ({other.sentence})" for other in others]
    lines += [f"  {first.separated_by}"] if first.separated_by else []
    return "\n".join([*lines, f"  card: {first.card}; add it with: misfit add {first.card} --to MODEL"])
