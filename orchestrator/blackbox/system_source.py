"""A coupled system where an FMU is expected: its description, its hash, and the child processes that run it."""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from fmus.errors import FmuError
from orchestrator.blackbox.exposed import Exposed, exposed, require_components
from orchestrator.blackbox.fmu_file import FmuFile
from orchestrator.blackbox.ports import Description
from orchestrator.blackbox.process import SYSTEM_ENDINGS, FmuProcesses
from orchestrator.blackbox.sites import Position
from orchestrator.cosim.load import load_system


def open_file(path: Path, *, stepped: bool = False, join_forces: bool = False) -> FmuFile:
    """An FMU, or a coupled system in its place.

    Args:
        stepped: run an FMU in co-simulation though it offers model exchange too.
        join_forces: of a system, make an input of each connected force as well.

    Raises:
        MisfitError: if the file is neither, or cannot be run.
        ComponentError: if the FMU fails while it is looked at.
    """
    if path.suffix.lower() in SYSTEM_ENDINGS:
        return SystemFile(path, join_forces=join_forces)
    file = FmuFile(path, stepped)
    if file.description.cosimulation or not file.probe().waits_for_events:
        return file
    # Its equations jump at times that no indicator tells, as those of a sampled controller do.
    file.close()
    file = FmuFile(path, stepped=True)
    if not file.description.cosimulation:
        raise FmuError(f"FMU {path.name} offers only model exchange with events; export it for co-simulation")
    return file


@dataclass(frozen=True)
class SystemFile(FmuFile):
    """A coupled system on disk; it is stepped, as an FMU for co-simulation is.

    Raises:
        MisfitError: if it is no system, or does not fit together.
    """

    stepped: bool = True
    join_forces: bool = False

    def __post_init__(self) -> None:
        """Read it and the files of its components once, so that what is wrong is found at once."""
        system = load_system(self.path)
        require_components(system)
        digest = hashlib.sha256(self.path.read_bytes())
        for spec in system.components.values():
            file = system.folder / spec.source
            digest.update(file.read_bytes() if spec.source and file.is_file() else spec.source.encode())
        object.__setattr__(self, "content_hash", digest.hexdigest())
        _ = self.description

    def __reduce__(self) -> tuple[type[FmuFile], tuple[Any, ...]]:
        """Travel to another process as a path; the children stay here."""
        return SystemFile, (self.path, self.stepped, self.join_forces)

    @cached_property
    def exposed(self) -> Exposed:
        """The system seen from outside."""
        return exposed(load_system(self.path), self.path.name, join_forces=self.join_forces)

    @cached_property
    def description(self) -> Description:
        """Its inputs, outputs and start values."""
        return self.exposed.description

    @cached_property
    def processes(self) -> FmuProcesses:
        """The children that run it."""
        return FmuProcesses(self.path, True, self.join_forces)

    @property
    def started(self) -> Description:
        """The description: a system shows no states."""
        return self.description

    def positions(self) -> dict[int, Position]:
        """None are known before it runs."""
        return {}
