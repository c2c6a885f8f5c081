"""One tool, one system, timed: `python contestants.py NAME FOLDER PAIRS STEPS` prints {"cpu_us": per step, "x": end of mass0}.

CPU time of the process while stepping, results of all outputs included, loading excluded. A tool that cannot
be imported ends with exit code 3.
"""

import json
import os
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path

STEP = 1e-4
REFERENCES = {
    "Mass": {"Fa": 0, "Fb": 1, "x": 2, "v": 3},
    "Spring": {"x1": 0, "v1": 1, "x2": 2, "v2": 3, "F1": 4, "F2": 5},
}
OUTPUTS = {"Mass": ("x", "v"), "Spring": ("F1", "F2")}


class Meter:
    """CPU seconds spent inside its `with` blocks."""

    def __init__(self) -> None:
        self.seconds = 0.0

    @contextmanager
    def running(self):
        began = time.process_time()
        yield
        self.seconds += time.process_time() - began


def parts(pairs: int) -> dict[str, str]:
    return {f"{kind.lower()}{i}": kind for i in range(pairs) for kind in ("Mass", "Spring")}


def connections(folder: Path, pairs: int) -> list[tuple[str, str, str, str]]:
    return [tuple(each) for each in json.loads((folder / f"connections{pairs}.json").read_text())]


def misfit(folder: Path, pairs: int, steps: int, meter: Meter, **options) -> float:
    """The compiled loop, in this process, results in memory."""
    from orchestrator.cosim.load import load_system
    from orchestrator.cosim.simulation import Simulation
    from orchestrator.results import MemoryRecorder

    recorder = MemoryRecorder()
    with Simulation(load_system(folder / f"system{pairs}.toml"), **options) as simulation:
        simulation.initialise()
        with meter.running():
            simulation.run(steps * STEP, recorder)
    return float(recorder.result()["mass0.x"][-1])


def misfit_python_master(folder: Path, pairs: int, steps: int, meter: Meter) -> float:
    """The same master in Python, as where there is no C compiler."""
    return misfit(folder, pairs, steps, meter, engine=False)


def misfit_parquet(folder: Path, pairs: int, steps: int, meter: Meter) -> float:
    """The compiled loop with results in a Parquet file."""
    from orchestrator.cosim.load import load_system
    from orchestrator.cosim.simulation import Simulation
    from orchestrator.results import read_result, recorder_for

    with tempfile.TemporaryDirectory() as work:
        target = Path(work) / "run.parquet"
        recorder = recorder_for(target)
        with Simulation(load_system(folder / f"system{pairs}.toml")) as simulation:
            simulation.initialise()
            simulation.run(64 * STEP, recorder)  # loads what writes files
            with meter.running():
                simulation.run(steps * STEP, recorder)
                recorder.finish()
        return float(read_result(target)["mass0.x"][-1])


def misfit_isolated(folder: Path, pairs: int, steps: int, meter: Meter) -> float:
    """The compiled loop in a process of its own, results in memory here."""
    from orchestrator.cosim.isolate.simulation import IsolatedSimulation
    from orchestrator.cosim.load import load_system
    from orchestrator.results import MemoryRecorder

    recorder = MemoryRecorder()
    with IsolatedSimulation(load_system(folder / f"system{pairs}.toml")) as simulation:
        simulation.initialise()
        child = f"/proc/{simulation._child._process.pid}/stat"

        def ticks() -> float:
            fields = Path(child).read_text().rpartition(")")[2].split()
            return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

        before = ticks()
        with meter.running():
            simulation.run(steps * STEP, recorder)
        meter.seconds += ticks() - before
    return float(recorder.result()["mass0.x"][-1])


def fmpy_arrays(folder: Path, pairs: int, steps: int, meter: Meter) -> float:
    """FMPy's C functions on arrays made beforehand: the fastest loop that one can write with it."""
    import ctypes

    import numpy as np

    loaded, links = _fmpy_parts(folder, pairs), connections(folder, pairs)
    Double, Reference = ctypes.c_double, ctypes.c_uint
    out = {
        name: ((Reference * 2)(*(REFERENCES[kind][o] for o in OUTPUTS[kind])), (Double * 2)())
        for name, (kind, _) in loaded.items()
    }
    into = {}
    for name, (kind, _) in loaded.items():
        mine = [
            (source, OUTPUTS[loaded[source][0]].index(o), REFERENCES[kind][i])
            for source, o, target, i in links
            if target == name
        ]
        into[name] = (mine, (Reference * len(mine))(*(r for *_, r in mine)), (Double * len(mine))())
    rows = np.zeros((steps + 1, 2 * len(loaded)))

    def read(kind: str) -> None:
        for name, (own, fmu) in loaded.items():
            if own == kind:
                references, values = out[name]
                fmu.fmi2GetReal(fmu.component, references, 2, values)

    def write(kind: str) -> None:
        for name, (own, fmu) in loaded.items():
            if own == kind:
                mine, references, values = into[name]
                for k, (source, place, _) in enumerate(mine):
                    values[k] = out[source][1][place]
                fmu.fmi2SetReal(fmu.component, references, len(mine), values)

    with meter.running():
        for step in range(steps + 1):
            read("Mass")
            write("Spring")
            read("Spring")
            write("Mass")
            row = rows[step]
            for k, (_, values) in enumerate(out.values()):
                row[2 * k : 2 * k + 2] = values
            if step < steps:
                for _, fmu in loaded.values():
                    fmu.fmi2DoStep(fmu.component, step * STEP, STEP, 1)
    return float(rows[-1, 0])


def fmpy_lists(folder: Path, pairs: int, steps: int, meter: Meter) -> float:
    """FMPy's getReal and setReal, once for each FMU and step."""
    loaded, links = _fmpy_parts(folder, pairs), connections(folder, pairs)
    values = {}
    rows = []

    def read(wanted: str) -> None:
        for name, (kind, fmu) in loaded.items():
            if kind == wanted:
                found = fmu.getReal([REFERENCES[kind][o] for o in OUTPUTS[kind]])
                values.update({(name, o): v for o, v in zip(OUTPUTS[kind], found, strict=True)})

    def write(wanted: str) -> None:
        for name, (kind, fmu) in loaded.items():
            if kind == wanted:
                mine = [(REFERENCES[kind][i], values[source, o]) for source, o, target, i in links if target == name]
                fmu.setReal([r for r, _ in mine], [v for _, v in mine])

    with meter.running():
        for step in range(steps + 1):
            read("Mass")
            write("Spring")
            read("Spring")
            write("Mass")
            rows.append(list(values.values()))
            if step < steps:
                for _, fmu in loaded.values():
                    fmu.doStep(step * STEP, STEP)
    return float(values["mass0", "x"])


def _fmpy_parts(folder: Path, pairs: int):
    import fmpy

    loaded = {}
    for name, kind in parts(pairs).items():
        unzipped = fmpy.extract(str(folder / f"{kind}.fmu"))
        fmu = fmpy.instantiate_fmu(unzipped, fmpy.read_model_description(unzipped), "CoSimulation")
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        loaded[name] = (kind, fmu)
    return loaded


def fmpy_ssp(folder: Path, pairs: int, steps: int, meter: Meter) -> float:
    """FMPy's simulate_ssp; it records every variable."""
    from fmpy.ssp.simulation import simulate_ssp

    from orchestrator.cosim.load import load_system
    from orchestrator.cosim.ssp import write_ssp

    with tempfile.TemporaryDirectory() as work:
        path = write_ssp(load_system(folder / f"system{pairs}.toml"), Path(work) / "system.ssp")
        simulate_ssp(str(path), stop_time=0.5 * STEP, step_size=STEP)
        before = Meter()
        with before.running():
            simulate_ssp(str(path), stop_time=0.5 * STEP, step_size=STEP)
        with meter.running():
            result = simulate_ssp(str(path), stop_time=(steps - 0.5) * STEP, step_size=STEP)
        meter.seconds -= before.seconds  # loading
    return float(result["mass0.x"][-1])


def fmu_container(folder: Path, pairs: int, steps: int, meter: Meter) -> float:
    """FMUContainer's compiled FMU of FMUs (one step late by its default), stepped and recorded by misfit's loop."""
    from fmu_manipulation_toolbox.assembly import Assembly

    from orchestrator.cosim import ComponentSpec, System
    from orchestrator.cosim.simulation import Simulation
    from orchestrator.results import MemoryRecorder

    with tempfile.TemporaryDirectory() as name:
        work, here = Path(name), Path.cwd()
        lines = ["rule;from_fmu;from_port;to_fmu;to_port"]
        for part, kind in parts(pairs).items():
            shutil.copyfile(folder / f"{kind}.fmu", work / f"{part}.fmu")
            lines.append(f"FMU;{part}.fmu;;;")
        lines += [f"LINK;{a}.fmu;{o};{b}.fmu;{i}" for a, o, b, i in connections(folder, pairs)]
        lines += [f"OUTPUT;{part}.fmu;{o};;{part}_{o}" for part, kind in parts(pairs).items() for o in OUTPUTS[kind]]
        (work / "box.csv").write_text("\n".join(lines) + "\n")
        os.chdir(work)  # it looks for description and FMUs there
        try:
            Assembly("box.csv", default_step_size=STEP, default_auto_link=False, fmu_directory=work).make_fmu(
                fmi_version=2
            )
        finally:
            os.chdir(here)
        recorder = MemoryRecorder()
        with Simulation(
            System("box", {"box": ComponentSpec("box", source="box.fmu")}, folder=work), step=STEP
        ) as simulation:
            simulation.initialise()
            with meter.running():
                simulation.run(steps * STEP, recorder)
    return float(recorder.result()["box.mass0_x"][-1])


def libcosim(folder: Path, pairs: int, steps: int, meter: Meter) -> float:
    """libcosim by libcosimpy, recorded by its time series observer."""
    from libcosimpy.CosimEnums import CosimVariableType
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    execution = CosimExecution.from_step_size(round(STEP * 1e9))  # ns
    index = {}
    kinds = parts(pairs)
    for name, kind in kinds.items():
        index[name] = execution.add_local_slave(CosimLocalSlave(str(folder / f"{kind}.fmu"), name))
    for a, o, b, i in connections(folder, pairs):
        execution.connect_real_variables(index[a], REFERENCES[kinds[a]][o], index[b], REFERENCES[kinds[b]][i])
    observer = CosimObserver.create_time_series(buffer_size=steps + 2)
    execution.add_observer(observer)
    for name, kind in kinds.items():
        for o in OUTPUTS[kind]:
            observer.start_time_series(index[name], REFERENCES[kind][o], CosimVariableType.REAL)
    with meter.running():
        execution.step(steps)
    last = CosimObserver.create_last_value()
    execution.add_observer(last)
    execution.step()
    return float(last.last_real_values(index["mass0"], [2])[0])


def ecos(folder: Path, pairs: int, steps: int, meter: Meter) -> float:
    """ecospy with its CSV writer; its wheel leaves out Intel's TBB, which is loaded first."""
    import ctypes

    beside = Path(sys.prefix) / "lib/libtbb.so.12"
    try:
        ctypes.CDLL(str(beside) if beside.exists() else "libtbb.so.12", ctypes.RTLD_GLOBAL)
    except OSError as error:
        raise ImportError(str(error)) from error
    from ecospy import EcosSimulation, EcosSimulationStructure

    with tempfile.TemporaryDirectory() as work, EcosSimulationStructure() as structure:
        for name, kind in parts(pairs).items():
            structure.add_model(name, str(folder / f"{kind}.fmu"))
        for a, o, b, i in connections(folder, pairs):
            structure.make_real_connection(f"{a}::{o}", f"{b}::{i}")
        with EcosSimulation(structure=structure, step_size=STEP) as simulation:
            simulation.add_csv_writer(str(Path(work) / "out.csv"))
            simulation.init()
            with meter.running():
                simulation.step(steps)
            return float(simulation.get_real("mass0::x"))


def cofmupy(folder: Path, pairs: int, steps: int, meter: Meter) -> float:
    """CoFmuPy, Jacobi; it keeps the results in lists."""
    import logging

    from cofmupy import Coordinator

    logging.disable(logging.CRITICAL)
    config = {
        "cosim_method": "jacobi",
        "fmus": [{"id": name, "path": str(folder / f"{kind}.fmu")} for name, kind in parts(pairs).items()],
        "connections": [
            {"source": {"id": a, "variable": o, "type": "fmu"}, "target": {"id": b, "variable": i, "type": "fmu"}}
            for a, o, b, i in connections(folder, pairs)
        ],
    }
    coordinator = Coordinator()
    with tempfile.TemporaryDirectory() as work:
        (Path(work) / "system.json").write_text(json.dumps(config))
        coordinator.start(str(Path(work) / "system.json"))
        with meter.running():
            for _ in range(steps):
                coordinator.do_step(STEP, save_data=True)
        return float(coordinator.get_variable(("mass0", "x"))[-1])


CONTESTANTS: dict[str, Callable[[Path, int, int, Meter], float]] = {
    f.__name__: f
    for f in (
        *(misfit, misfit_parquet, misfit_isolated, misfit_python_master),
        *(fmu_container, ecos, libcosim, fmpy_arrays, fmpy_lists, fmpy_ssp, cofmupy),
    )
}


def main() -> None:
    """Run one contestant."""
    name, folder, pairs, steps = sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4])
    meter = Meter()
    # What tools print is no part of the answer.
    answer = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    try:
        x = CONTESTANTS[name](folder, pairs, steps, meter)
    except ImportError as error:
        print(error, file=sys.stderr)
        sys.exit(3)
    answer.write(json.dumps({"cpu_us": 1e6 * meter.seconds / steps, "x": x}) + "\n")
    answer.flush()
    os._exit(0)  # some libraries crash when they are unloaded


if __name__ == "__main__":
    main()
