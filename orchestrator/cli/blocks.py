"""`misfit blocks`."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fmus.units import after_number
from orchestrator.cli.common import html_option, json_option, quiet_option, show, write_file, write_json

if TYPE_CHECKING:
    from orchestrator.gp.block import Block


@click.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@json_option
@html_option
@quiet_option
def blocks(files: tuple[Path, ...], json_file: str | None, html_file: str | None, quiet: bool) -> None:
    """Show saved blocks: where they come from, what they are worth; compare those over the same inputs at the data of both."""
    from orchestrator.gp.alike import pairs
    from orchestrator.gp.saved import read_block

    read = [(str(file), read_block(file)) for file in files]
    compared = pairs(read)
    lines = [line for name, block in read for line in _lines(name, block)]
    for one, other, found in compared:
        lines += [
            f"{one} and {other}, {each.output}: differ by {each.difference:.3g}{after_number(each.unit)} rms (they are {each.first:.3g} and "
            f"{each.second:.3g}), at {100 * each.inside:.0f} % of the data inside 90 % intervals"
            for each in found
        ] or [f"{one} and {other} have no output over the same inputs to compare"]
    show("\n".join(lines), quiet or json_file == "-")
    write_json(json_file, _document(read, compared))
    if html_file is not None:
        write_file(html_file, _report(read, lines))


def _lines(name: str, block: "Block") -> list[str]:
    about = dict(block.about)
    count = len(block.posterior.rows.inputs)
    line = f"{name}: {', '.join(o.name for o in block.outputs)} over {', '.join((*block.inputs, *block.factors))}, {count} data"
    if "model" in about:
        line += f"; {about['model']} {str(about.get('model_version', ''))[:8]}"
    if "data_hash" in about:
        line += f", {about.get('data', 'data')} {str(about['data_hash'])[:8]}"
    if "held_out_after" in about:
        line += f"; held-out free run {float(about['held_out_before']):.3g} to {float(about['held_out_after']):.3g}"
    if "left_out_inside_90" in about:
        line += (
            f"; {100 * float(about['left_out_inside_90']):.0f} % of the data inside the 90 % intervals of all others"
        )
    if priors := _priors(block):
        line += f"; expects what {', '.join(dict.fromkeys(each['model'] for each in priors.values()))} says"
    return [line]


def _priors(block: "Block") -> dict[str, dict[str, str]]:
    """Models that latent functions are expected to follow, with their versions."""
    from orchestrator.gp.physics import physics_of

    found = {name: physics_of(latent) for name, latent in block.posterior.latents.items()}
    return {
        name: {"model": physics.origin.model, "version": physics.origin.version}
        for name, physics in found.items()
        if physics is not None and physics.origin is not None
    }


def _document(read: list[tuple[str, "Block"]], compared: list[Any]) -> dict[str, Any]:
    return {
        "schema": "misfit.blocks/1",
        "blocks": [
            {
                "file": name,
                "inputs": dict(block.inputs),
                "factors": list(block.factors),
                "outputs": {output.name: output.unit for output in block.outputs},
                "count": len(block.posterior.rows.inputs),
                "about": dict(block.about),
                "priors": _priors(block),
            }
            for name, block in read
        ],
        "compared": [
            {"blocks": [one, other], "outputs": [asdict(each) for each in found]} for one, other, found in compared
        ],
    }


def _report(read: list[tuple[str, "Block"]], lines: list[str]) -> str:
    """A page with the lines and, for each block, mean and 90 % band of each output over each input."""
    from orchestrator.report import figures
    from orchestrator.report.html import render
    from orchestrator.report.page import Page, Picture, Section

    caption = "Mean with 90 % band; ticks are data; inputs that an axis does not show stand at their median."
    sections = tuple(Section(name, pictures=(Picture(figures.block_slices(block), caption),)) for name, block in read)
    return render(Page("Learned blocks", " ".join(lines), None, sections))
