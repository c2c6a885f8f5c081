"""Speed of building and simulating the arm; run by `make bench`, never as a test.

Every figure is the median of interleaved rounds in one process; simulations are also given as a ratio to FMPy's
`simulate_fmu` of the same FMU on the same inputs.
"""

import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from step_cost import print_table

ROUNDS = 7


def main() -> None:
    """Print the tables; exit code 1 when the FMU costs too much."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ["MISFIT_CACHE"] = str(Path(folder) / "cache")  # everything is built from scratch
        _building(Path(folder))
        _simulating(Path(folder))
        if not print_table(Path(folder)):
            sys.exit(1)


def _timed(work: Callable[[], object]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def _building(folder: Path) -> None:
    from fmus.catalogue import find_modelica_model
    from fmus.frontend.compile import compile_class
    from fmus.package import build_fmu
    from fmus.symbolic.build import build_system
    from orchestrator.models.compiled import CompiledModel

    print(f"{'building the arm, first time':52s} seconds")
    arm = find_modelica_model("arm")
    print(f"{'Modelica -> flat DAE (child process)':52s} {_timed(arm.compile):.3f}")
    dae = compile_class(arm.class_name)
    print(f"{'flat DAE -> explicit symbolic functions':52s} {_timed(lambda: build_system(dae, 'arm')):.3f}")
    system = arm.compile()
    print(f"{'symbolic functions -> FMU':52s} {_timed(lambda: build_fmu(system, folder / 'arm.fmu')):.3f}")
    compiled = CompiledModel(system, ["q1", "q2"], ["linkage.b[1]", "linkage.b[2]"])
    print(f"{'symbolic functions -> compiled free run':52s} {_timed(lambda: compiled._machine_code):.3f}")


def _simulating(folder: Path) -> None:
    import fmpy
    import numpy as np

    from fmus.catalogue import find_modelica_model
    from orchestrator.blackbox.source import fmu_model
    from orchestrator.models.compiled import CompiledModel

    time_s = np.arange(2501) * 0.004
    alpha = 0.3 + 0.2 * np.sin(2 * np.pi * 0.4 * time_s[:, None] + np.arange(6))
    inputs = np.column_stack([alpha, np.zeros((len(time_s), 4))])
    start = {"linkage.q[1]": 0.8, "linkage.q[2]": 1.2, "linkage.w[1]": 0.0, "linkage.w[2]": 0.0}
    system = find_modelica_model("arm").compile()
    model = CompiledModel(system, ["q1", "q2"], ["linkage.b[1]", "linkage.b[2]"])
    first = np.array(list(start.values()))
    fmu = fmu_model(folder / "arm.fmu", stepped=True)
    names = [v.name for v in system.inputs]
    table = np.array(
        [(t, *row) for t, row in zip(time_s, inputs, strict=True)],
        dtype=[("time", float), *((n, float) for n in names)],
    )
    options = {"stop_time": 10, "output_interval": 0.004, "step_size": 0.004, "input": table, "output": ["q1", "q2"]}
    unzipped = fmpy.extract(str(folder / "arm.fmu"), str(folder / "unzipped"))
    work: dict[str, Callable[[], object]] = {
        "FMPy simulate_fmu (reference)": lambda: fmpy.simulate_fmu(unzipped, start_values=start, **options),
        "FMU in a child process, inputs interpolated": lambda: fmu.simulate(time_s, inputs, ["q1", "q2"], start),
        "compiled free run": lambda: model.run(time_s, inputs, model.parameters, first),
        "compiled free run with 6 sensitivities": lambda: model.run(
            time_s, inputs, model.parameters, first, sensitivities=True
        ),
    }
    times: dict[str, list[float]] = {name: [] for name in work}
    for _ in range(ROUNDS + 1):
        for name, run in work.items():
            times[name].append(_timed(run))
    reference = statistics.median(times["FMPy simulate_fmu (reference)"][1:])
    print(f"\n{'10 s of the arm, 2501 samples':52s} ms     / reference")
    for name, values in times.items():
        median = statistics.median(values[1:])  # the first round loads libraries
        print(f"{name:52s} {1000 * median:6.1f} {median / reference:.3f}")
    fmu.file.close()


if __name__ == "__main__":
    main()
