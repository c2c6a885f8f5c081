"""An FMU on disk: its description, its hash, and the child processes that run it."""

import hashlib
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from fmus.archive import read_archive
from fmus.errors import FmuError
from orchestrator.blackbox.ports import Description, Port, describe
from orchestrator.blackbox.process import FmuProcesses
from orchestrator.blackbox.sites import Position, find_positions, plain_sites
from orchestrator.blackbox.worker import PathRequest, Probe, ProbeRequest, SlopesRequest

NOTHING: Mapping[int, float] = MappingProxyType({})


@dataclass(frozen=True)
class FmuFile:
    """An FMU of any vendor. With `stepped` it is run in co-simulation though it offers model exchange too.

    Raises:
        FmuError: if the file is not a usable FMU.
    """

    path: Path
    stepped: bool = False
    content_hash: str = field(init=False)

    def __post_init__(self) -> None:
        """Read it once, so that a broken file is found at once."""
        try:
            content = self.path.read_bytes()
        except OSError as error:
            raise FmuError(f"FMU {self.path} cannot be read: {error.strerror}") from error
        object.__setattr__(self, "content_hash", hashlib.sha256(content).hexdigest())
        _ = self.description

    def __reduce__(self) -> tuple[type["FmuFile"], tuple[Any, ...]]:
        """Travel to another process as a path; the children stay here."""
        return FmuFile, (self.path, self.stepped)

    @cached_property
    def description(self) -> Description:
        """What the FMU shows, with the start values that it really has."""
        import fmpy

        files = read_archive(self.path)  # refuses archives that are broken or unsafe
        try:
            # What the schema forbids is told by `misfit validate`; tools write attributes of drafts, and their FMUs run.
            read: Any = fmpy.read_model_description(str(self.path), validate=False)
        except Exception as error:  # fmpy raises many kinds for a broken description
            reason = " ".join(str(error).split())[:200]
            raise FmuError(f"FMU {self.path.name} has no usable model description: {reason}") from error
        if read.fmiVersion == "3.0" and read.modelExchange is not None:  # fmpy leaves this attribute out
            exchange = ET.fromstring(files["modelDescription.xml"]).find("ModelExchange")
            offered = exchange is not None and exchange.get("providesDirectionalDerivatives") in ("true", "1")
            read.modelExchange.providesDirectionalDerivative = offered
        if self.stepped and read.coSimulation is not None:
            read.modelExchange = None
        return describe(read, self.path.name)

    @cached_property
    def processes(self) -> FmuProcesses:
        """The children that run it."""
        return FmuProcesses(self.path, self.description.cosimulation)

    @cached_property
    def started(self) -> Description:
        """The description with the states' start values as the FMU has them after its initialisation."""
        description = self.description
        if description.cosimulation or not description.states:
            return description
        values = self.probe().states
        states = tuple(
            Port(replace(p.variable, start=float(v)), p.reference, p.place, p.size)
            for p, v in zip(description.states, values, strict=True)
        )
        return replace(description, states=states)

    def probe(self, start: np.ndarray | None = None, inputs: np.ndarray | None = None) -> Probe:
        """Jacobians of rates and outputs; model exchange only.

        Raises:
            ComponentError: if the FMU fails.
        """
        description, wiring = self.description, plain_sites(self.description).wiring
        idle = np.array([p.variable.start or 0.0 for p in description.inputs])
        request = ProbeRequest(
            wiring,
            tuple(p.reference for p in description.states),
            tuple(p.reference for p in description.rates),
            idle if inputs is None else inputs,
            start,
            self._asks_directions,
        )
        return self.processes.ask(request)  # type: ignore[no-any-return]

    def jacobians(
        self, time: np.ndarray, inputs: np.ndarray, start: np.ndarray, substeps: int, held: Sequence[str] = ()
    ) -> np.ndarray:
        """Jacobians (n, nx + outputs, nx + inputs) of rates and outputs along a free run; model exchange only.

        Args:
            time: (n,) in s.
            inputs: (n, nu), in the order of the FMU's inputs.
            start: (nx,), first values of the states.
            substeps: integration steps in a sample interval.
            held: names of the inputs that are held between samples; the others run in straight lines.

        Raises:
            ComponentError: if the FMU fails.
        """
        request = PathRequest(
            plain_sites(self.description).wiring,
            tuple(p.reference for p in self.description.states),
            tuple(p.reference for p in self.description.rates),
            time,
            inputs,
            start,
            substeps,
            self._asks_directions,
            tuple(port.name in held for port in self.description.inputs),
        )
        return np.asarray(self.processes.ask(request))

    def slopes(
        self, time: np.ndarray, states: np.ndarray, inputs: np.ndarray, settings: Mapping[int, float] = NOTHING
    ) -> tuple[np.ndarray, np.ndarray]:
        """Rates and outputs (n, nx + outputs) and their Jacobians (n, nx + outputs, nx + inputs) at given points; model
        exchange only. `settings` are values of parameters by value reference.

        Args:
            time: (n,) in s.
            states: (n, nx).
            inputs: (n, nu), in the order of the FMU's inputs.
            settings: values of parameters by value reference.

        Raises:
            ComponentError: if the FMU fails.
        """
        request = SlopesRequest(
            plain_sites(self.description).wiring,
            tuple(p.reference for p in self.description.states),
            tuple(p.reference for p in self.description.rates),
            time,
            states,
            inputs,
            {reference: [value] for reference, value in settings.items()},
            self._asks_directions,
        )
        values, jacobians = self.processes.ask(request)
        # Some FMUs give no derivative of an output that is a state itself.
        places = {p.reference: k for k, p in enumerate(self.description.states)}
        for row, port in enumerate(self.description.outputs, start=len(self.description.states)):
            if port.reference in places and port.size == 1:
                jacobians[:, row] = np.eye(jacobians.shape[2])[places[port.reference]]
        return values, jacobians

    @property
    def _asks_directions(self) -> bool:
        """Whether directional derivatives are offered, for scalars."""
        ports = (*self.description.inputs, *self.description.outputs, *self.description.states)
        return self.description.directional and all(port.size == 1 for port in ports)

    def positions(self) -> dict[int, Position]:
        """Outputs that read a state whose rate is another state; found in model exchange only."""
        if self.description.cosimulation or not self.description.states:
            return {}
        probe = self.probe()
        found = find_positions(probe, probe.outputs, probe.states)
        # An output that merely happens to be linear where the FMU starts is none.
        moved = probe.states + 0.37 * (1 + np.abs(probe.states))
        elsewhere = self.probe(moved)
        again = find_positions(elsewhere, elsewhere.outputs, moved)
        return {
            k: p
            for k, p in found.items()
            if k in again
            and (again[k].state, again[k].speed) == (p.state, p.speed)
            and np.isclose(again[k].slope, p.slope)
        }

    def close(self) -> None:
        """End the child processes."""
        if "processes" in self.__dict__:
            self.processes.close()
