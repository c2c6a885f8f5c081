"""Child process that runs one FMU, so that a crash or a hang in its native code does not take the host along."""

import sys
import tempfile
from collections.abc import Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np


class _Slave:
    """An FMI 2.0 co-simulation slave that can be run again and again."""

    def __init__(self, path: Path, folder: Path) -> None:
        import fmpy
        from fmpy.fmi2 import FMU2Slave

        from fmus.archive import extract_fmu

        extract_fmu(path, folder)
        description = fmpy.read_model_description(str(folder))
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        self.interpolates = bool(description.coSimulation.canInterpolateInputs)
        self.fmu = FMU2Slave(
            guid=description.guid,
            unzipDirectory=str(folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=description.modelName,
        )
        self.fmu.instantiate()
        self._used = False

    def run(
        self,
        time: np.ndarray,
        inputs: np.ndarray,
        input_names: Sequence[str],
        output_names: Sequence[str],
        start: dict[str, float],
    ) -> np.ndarray:
        """Outputs of shape (n, ny) at the sample times, with inputs linear between samples.

        An FMU that cannot interpolate gets the mean of each interval, which keeps the inputs from lagging.
        """
        fmu, sources = self.fmu, [self.references[name] for name in input_names]
        targets = [self.references[name] for name in output_names]
        if self._used:
            fmu.reset()
        self._used = True
        fmu.setupExperiment(startTime=float(time[0]))
        fmu.setReal([self.references[name] for name in start], list(start.values()))
        fmu.setReal(sources, inputs[0])
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        outputs = np.empty((len(time), len(targets)))
        for k in range(len(time)):
            fmu.setReal(sources, inputs[k])
            outputs[k] = fmu.getReal(targets)
            if k + 1 == len(time):
                break
            step = time[k + 1] - time[k]
            if self.interpolates and sources:
                slopes = (inputs[k + 1] - inputs[k]) / step
                fmu.setRealInputDerivatives(sources, [1] * len(sources), slopes)
            else:
                fmu.setReal(sources, 0.5 * (inputs[k] + inputs[k + 1]))
            fmu.doStep(float(time[k]), float(step))
        return outputs


def serve(path: Path, connection: Connection) -> None:
    """Answer requests until the connection closes: ("ok", result) or ("error", message)."""
    with tempfile.TemporaryDirectory() as folder:
        slave: _Slave | None = None
        while True:
            try:
                request: tuple[Any, ...] = connection.recv()
            except EOFError:
                return
            try:
                if slave is None:
                    slave = _Slave(path, Path(folder))
                connection.send(("ok", slave.run(*request)))
            except Exception as error:  # whatever native wrappers raise becomes a message for the host
                connection.send(("error", " ".join(str(error).split()) or type(error).__name__))
            sys.stdout.flush()
