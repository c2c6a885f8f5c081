"""`misfit learn`."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fmus.units import after_number
from orchestrator.cli.common import (
    can_be_written,
    json_option,
    library_option,
    progress,
    quiet_option,
    show,
    write_json,
)

if TYPE_CHECKING:
    from orchestrator.gp.from_trials import Learned

REFUSED = 1


@click.command()
@click.argument("model")
@click.argument("data")
@library_option
@click.option("--out", "block_file", metavar="F", default="block.json", show_default=True, callback=can_be_written,
              help="Where to write the block (.json); its FMU and the coupled system come into a folder of that name.")  # fmt: skip
@click.option("--most", type=click.IntRange(10, 2000), default=300, show_default=True, help="Data for each output.")
@click.option("--factors", is_flag=False, flag_value="auto", default="auto", show_default=True, metavar="NAMES",
              help="Inputs of MODEL that multiply a function of their own each, such as alpha_1,alpha_3; "
              "auto: all that move in the trials; none: forces depend on positions and speeds alone.")  # fmt: skip
@json_option
@quiet_option
def learn(model: str, data: str, block_file: str, most: int, factors: str, json_file: str | None, quiet: bool) -> None:
    """Learn the force that MODEL lacks along DATA, such as a recorded session of trials, as a Gaussian process.

    The block is judged by free runs along the held-out trials; one that makes them worse is shrunk, or refused with exit code 1.
    """
    from orchestrator.datacheck.holding import with_interpolation
    from orchestrator.gp.from_trials import learn_missing
    from orchestrator.gp.saved import write_block
    from orchestrator.gp.trials.coupled import write_coupled
    from orchestrator.measurements import bind, load_measurements
    from orchestrator.model_argument import load_modelica, with_forces

    if not Path(block_file).suffix:  # the folder has that name
        block_file += ".json"
    with progress(quiet) as say:
        say(f"reading {data}")
        loaded = with_forces(load_modelica(model), model)
        measurements = with_interpolation(loaded, recorded := load_measurements(data))
        bound = bind(measurements, loaded.inputs, [v for v in loaded.outputs if v.name in loaded.signals])
        say("finding the missing force along every trial")
        model_used = loaded.restricted(bound.output_names)
        found = learn_missing(model_used, bound, most, _factors(factors))
        if found.block is not None:
            about = _about(found, model, loaded.content_hash, data, measurements.content_hash)
            write_block(replace(found.block, about=about), Path(block_file))
            say("building the FMUs of model and block")
            write_coupled(model_used, found.block, found.judgement, bound.held_out, Path(block_file).with_suffix(""))
    units = {variable.name: variable.unit for variable in loaded.outputs}
    lines = [note for note in measurements.notes if note not in recorded.notes] + _lines(found, block_file, units)
    show("\n".join(lines), quiet or json_file == "-")
    system = str(Path(block_file).with_suffix("") / "system.toml") if found.block is not None else None
    written = block_file if found.block is not None else None
    write_json(
        json_file,
        {
            "schema": "misfit.learn/1",
            "model": model,
            "data": str(data),
            "block": written,
            "system": system,
            "count": found.count,
            "held_out": _held_out(found),
            "functions": _functions(found),
            "free_run": _free_run(found, units),
        },
    )
    if found.block is None:
        raise SystemExit(REFUSED)


def _about(found: "Learned", model: str, version: str, data: str, data_hash: str) -> dict[str, str | float]:
    """Where a block comes from and what it is worth."""
    about: dict[str, str | float] = {"model": model, "model_version": version, "data": data, "data_hash": data_hash}
    if found.judgement is not None:
        about["held_out_before"], about["held_out_after"] = found.judgement.before.all, found.judgement.after.all
    return about


def _factors(given: str) -> list[str] | None:
    if given == "auto":
        return None
    return [] if given == "none" else [name.strip() for name in given.split(",") if name.strip()]


def _lines(found: "Learned", block_file: str, units: dict[str, str]) -> list[str]:
    """What is said of a block: where it is, what it is made of, and errors before and after."""
    from orchestrator.gp.trials.own_effect import in_words

    lines, words = [], in_words(found.shares)
    if found.block is not None:
        lines.append(f"{found.count} data over {', '.join(found.block.inputs)} in {block_file}")
        lines.append(f"coupled to its model in {Path(block_file).with_suffix('')}/system.toml")
    for each in found.functions:
        name = f"{each.output}: a function times {each.factor}" if each.factor else f"{each.output}: a function alone"
        if each.needed:
            told = words.get((each.output, each.factor))
            lines.append(
                f"{name} is needed ({each.size:.3g} rms, {each.gain:.0f} nats)" + (f", {told}" if told else "")
            )
    for force in found.held_out:
        lines.append(
            f"{force.output}, held out: {force.before:.3g}{after_number(force.unit)} without the block, {force.after:.3g}{after_number(force.unit)} with it"
        )
    if found.judgement is None:
        return [*lines, "no held-out trials: nobody knows whether the block helps; name some in case.toml"]
    before, after = found.judgement.before.signals, found.judgement.after.signals
    for name in before:
        lines.append(
            f"free run, held out: {name} {before[name]:.3g} {units[name]} without the block, {after[name]:.3g} {units[name]} with it"
        )
    return [*lines, f"the block is {found.judgement.verdict}: {found.judgement.reason}"]


def _held_out(found: "Learned") -> dict[str, Any]:
    return {each.output: {"unit": each.unit, "before": each.before, "after": each.after} for each in found.held_out}


def _functions(found: "Learned") -> list[dict[str, Any]]:
    own = {(each.output, each.factor): each.share for each in found.shares}
    return [
        {
            "function": each.function,
            "output": each.output,
            "factor": each.factor or None,
            "verdict": "needed" if each.needed else "not needed",
            "rms": float(each.size),
            "gain_nats": float(each.gain),
            "price_nats": float(each.price),
            "share": own.get((each.output, each.factor)),
        }
        for each in found.functions
    ]


def _free_run(found: "Learned", units: dict[str, str]) -> dict[str, Any] | None:
    judgement = found.judgement
    if judgement is None:
        return None
    before, after, refused = judgement.before, judgement.after, judgement.refused
    return {
        "held_out_before": before.all,
        "held_out_after": after.all,
        "verdict": judgement.verdict,
        "reason": judgement.reason,
        "shares": dict(judgement.shares),
        "signals": {
            name: {"unit": units[name], "before": before.signals[name], "after": after.signals[name]}
            for name in before.signals
        },
        "trials": {
            name: {signal: {"before": row[signal], "after": after.trials[name][signal]} for signal in row}
            for name, row in before.trials.items()
        },
        "as_learned": None if refused is None else refused.finite(),
    }
