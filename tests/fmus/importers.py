"""Programs of others that run FMUs, each behind the same function; run as `importers.py NAME JOBS RESULTS`.

JOBS is a JSON list of jobs (fields of `Job`), RESULTS gets one JSON line a job: the outputs after each step. A crash of
the importer's library takes this process along, so the lines written before it tell which FMU it was.
"""

import ctypes
import ctypes.util
import json
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Rows = list[list[float]]


@dataclass(frozen=True)
class Job:
    """Run an FMU from t = 0 in equal steps (s) with constant inputs, and report its outputs after each step."""

    fmu: str
    step: float
    steps: int
    inputs: dict[str, float]
    outputs: list[str]


def fmpy_co_simulation(job: Job) -> Rows:
    """FMPy calls doStep."""
    return _fmpy(job.fmu, job, fmi_type="CoSimulation")


def fmpy_model_exchange(job: Job) -> Rows:
    """FMPy integrates with CVODE."""
    return _fmpy(job.fmu, job, fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-10)


def fmu_container(job: Job) -> Rows:
    """The C program in FMUContainer's FMU runs the FMU inside; FMPy runs the container."""
    from fmu_manipulation_toolbox.assembly import Assembly

    with tempfile.TemporaryDirectory() as name:
        folder, here = Path(name), Path.cwd()
        (folder / "unit.fmu").write_bytes(Path(job.fmu).read_bytes())
        (folder / "box.csv").write_text("rule;from_fmu;from_port;to_fmu;to_port\nFMU;unit.fmu;;;\n")
        os.chdir(folder)  # it looks for description and FMUs there
        try:
            Assembly("box.csv", default_step_size=job.step, fmu_directory=folder).make_fmu(
                fmi_version=3 if ".fmi3." in job.fmu else 2
            )
        finally:
            os.chdir(here)
        # It lists outputs that are states with exact start values among its InitialUnknowns, which FMPy refuses.
        return _fmpy(str(folder / "box.fmu"), job, fmi_type="CoSimulation", validate=False)


def libcosim(job: Job) -> Rows:
    """Open Simulation Platform's co-simulation library, on Modelon's FMI Library."""
    from fmpy import read_model_description
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    references = {v.name: v.valueReference for v in read_model_description(job.fmu).modelVariables}
    execution = CosimExecution.from_step_size(round(job.step * 1e9))  # ns
    slave = CosimLocalSlave(fmu_path=job.fmu, instance_name="unit")
    index = execution.add_local_slave(slave)
    for name, value in job.inputs.items():
        execution.real_initial_value(index, references[name], value)
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    rows = []
    for _ in range(job.steps):
        if not execution.step():
            raise RuntimeError("libcosim refused a step")
        rows.append(list(observer.last_real_values(index, [references[name] for name in job.outputs])))
    return rows


def ecos(job: Job) -> Rows:
    """ecospy; its wheel leaves out Intel's TBB, which has to be found elsewhere and loaded first."""
    ctypes.CDLL(tbb_library() or "libtbb.so.12", ctypes.RTLD_GLOBAL)
    from ecospy import EcosSimulation, EcosSimulationStructure

    with EcosSimulationStructure() as structure:
        structure.add_model("unit", job.fmu)
        structure.add_parameter_set("start", {f"unit::{name}": value for name, value in job.inputs.items()})
        with EcosSimulation(structure=structure, step_size=job.step) as simulation:
            simulation.init(parameter_set="start")
            rows = []
            for _ in range(job.steps):
                simulation.step()
                rows.append([simulation.get_real(f"unit::{name}") for name in job.outputs])
    return rows


def tbb_library() -> str | None:
    """Path or name of Intel's TBB: beside this Python, where its wheel puts it, or installed in the system."""
    beside = Path(sys.prefix) / "lib" / "libtbb.so.12"
    return str(beside) if beside.is_file() else ctypes.util.find_library("tbb")


def pathsim(job: Job) -> Rows:
    """PathSim integrates the FMU for model exchange with its own Runge-Kutta method."""
    from pathsim import Connection, Simulation
    from pathsim.blocks import Constant
    from pathsim.solvers import RKDP54
    from pathsim_fmi import ModelExchangeFMU

    block = ModelExchangeFMU(job.fmu, start_values=job.inputs)
    sources = [Constant(value) for value in job.inputs.values()]
    simulation = Simulation(
        [block, *sources],
        [Connection(source, block[i]) for i, source in enumerate(sources)],
        Solver=RKDP54,
        dt=job.step / 4,
        log=False,
    )
    rows = []
    for _ in range(job.steps):
        simulation.run(job.step, reset=False, adaptive=False)
        rows.append([float(block.outputs[i]) for i in range(len(job.outputs))])
    return rows


IMPORTERS: dict[str, Callable[[Job], Rows]] = {
    function.__name__: function
    for function in (fmpy_co_simulation, fmpy_model_exchange, fmu_container, libcosim, ecos, pathsim)
}


def _fmpy(fmu: str, job: Job, **options: Any) -> Rows:
    from fmpy import simulate_fmu

    result = simulate_fmu(
        fmu,
        stop_time=job.step * job.steps,
        step_size=job.step,
        output_interval=job.step,
        start_values=job.inputs,
        output=job.outputs,
        record_events=False,
        **options,
    )
    return [[float(row[name]) for name in job.outputs] for row in result[1:]]


def _results(importer: Callable[[Job], Rows], jobs: list[Job]) -> Iterator[str]:
    for job in jobs:
        yield json.dumps(importer(job)) + "\n"


if __name__ == "__main__":
    chosen, jobs_file, results_file = sys.argv[1:]
    work = [Job(**fields) for fields in json.loads(Path(jobs_file).read_text())]
    with open(results_file, "w", buffering=1) as stream:
        stream.writelines(_results(IMPORTERS[chosen], work))
