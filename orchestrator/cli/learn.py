"""`misfit learn`."""

from pathlib import Path

import click

from orchestrator.cli.common import can_be_written, json_option, progress, quiet_option, show, write_json


@click.command()
@click.argument("model")
@click.argument("data")
@click.option("--out", "block_file", metavar="F", default="block.json", show_default=True, callback=can_be_written,
              help="Where to write the block; `misfit build F` makes an FMU of it.")  # fmt: skip
@click.option("--most", type=click.IntRange(10, 2000), default=300, show_default=True, help="Data for each output.")
@json_option
@quiet_option
def learn(model: str, data: str, block_file: str, most: int, json_file: str | None, quiet: bool) -> None:
    """Learn the force that MODEL lacks along DATA, such as a recorded session of trials, as a Gaussian process."""
    from orchestrator.gp.from_trials import learn_missing
    from orchestrator.gp.saved import write_block
    from orchestrator.measurements import bind, load_measurements
    from orchestrator.models.load import load_modelica
    from orchestrator.models.symbolic import SymbolicModel

    with progress(quiet) as say:
        say(f"reading {data}")
        measurements = load_measurements(data)
        loaded = SymbolicModel(model, load_modelica(model).compile())
        bound = bind(measurements, loaded.inputs, loaded.outputs)
        say("finding the missing force along every trial")
        found = learn_missing(loaded.restricted(bound.output_names), bound, most)
        write_block(found.block, Path(block_file))
    lines = [f"{found.count} data over {', '.join(found.block.inputs)} in {block_file}"]
    lines += [
        f"{each.output}, held out: {each.before:.3g} {each.unit} without the block, {each.after:.3g} {each.unit} with it"
        for each in found.held_out
    ]
    show("\n".join(lines), quiet or json_file == "-")
    write_json(
        json_file,
        {
            "schema": "misfit.learn/1",
            "model": model,
            "data": str(data),
            "block": block_file,
            "count": found.count,
            "held_out": {
                each.output: {"unit": each.unit, "before": each.before, "after": each.after} for each in found.held_out
            },
        },
    )
