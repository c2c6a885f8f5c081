"""A block as an FMU with its data baked in: any importer can use the learned effect, without Python."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import casadi as ca

from fmus.package import build_fmu
from fmus.platforms import Platform
from fmus.symbolic.system import SymbolicSystem, Variable
from orchestrator.gp.block import DEVIATION, Block, Output
from orchestrator.gp.symbolic import deviation_of, mean_of


def block_fmu(block: Block, path: Path, fmi_version: str = "2.0", platforms: Sequence[Platform] = ()) -> Path:
    """Write the FMU of a block and give its path back: the block's inputs, outputs and standard deviations, as
    functions of the inputs.

    It has no states. Slopes are exact, by its directional derivatives. The square of the number of data is the size of
    the library.

    Args:
        block: the block.
        path: the file to write.
        fmi_version: "2.0" or "3.0".
        platforms: platforms beside this machine's that it gets a library for.

    Raises:
        MisfitError: if a latent function has a prior mean that is code and no physics model, or there is no C compiler.
    """
    system = block_system(block, path.name.split(".")[0])
    return build_fmu(system, path, fmi_version=fmi_version, platforms=platforms)


def block_system(block: Block, name: str) -> SymbolicSystem:
    """A block as a system of equations without states."""
    units = {**block.inputs, **dict.fromkeys(block.factors, "1")}
    u = ca.MX.sym("u", len(units))
    values = dict(zip(units, ca.vertsplit(u), strict=True))
    x = u[: len(block.inputs)]
    combinations = {o.terms: _factors(o, values) for o in block.outputs}
    spreads = {terms: deviation_of(block.posterior, factors, x) for terms, factors in combinations.items()}
    means = mean_expressions(block, values)
    deviations = [spreads[output.terms] for output in block.outputs]
    t, none, p = ca.MX.sym("t"), ca.MX.sym("none", 0), ca.MX.sym("p", 0)
    empty = ca.MX(0, 1)
    outputs = [Variable(o.name, o.unit, "expected value") for o in block.outputs]
    outputs += [Variable(o.name + DEVIATION, o.unit, "standard deviation") for o in block.outputs]
    return SymbolicSystem(
        name=name,
        description="Learned from measurements",
        inputs=tuple(Variable(each, unit, start=0.0) for each, unit in units.items()),
        states=(),
        algebraics=tuple(outputs),
        parameters=(),
        dependents=(),
        outputs=tuple(v.name for v in outputs),
        rhs=ca.Function("rhs", [t, none, u, ca.MX.sym("d", 0), p], [empty, ca.vertcat(*means, *deviations)]),
        history=ca.Function("history", [t, u, p], [empty, empty]),
        dependent=ca.Function("dependent", [p], [empty]),
        initial=ca.Function("initial", [p], [empty]),
    )


def mean_expressions(block: Block, values: Mapping[str, ca.MX]) -> list[ca.MX]:
    """Expected value of each output of a block, as a CasADi expression of the values of its inputs by name."""
    x = ca.vertcat(*[values[name] for name in block.inputs])
    latents = {term.latent: mean_of(block.posterior, term.latent, x) for o in block.outputs for term in o.terms}
    return [
        sum((f * latents[name][o.component] for name, f in _factors(o, values).items()), ca.MX(0))
        for o in block.outputs
    ]


def _factors(output: Output, values: Mapping[str, ca.MX]) -> dict[str, ca.MX]:
    """What each latent function counts in an output."""
    found: dict[str, ca.MX] = {}
    for term in output.terms:
        factor = ca.MX(term.factor) * (values[term.input] if term.input else 1.0)
        found[term.latent] = found[term.latent] + factor if term.latent in found else factor
    return found
