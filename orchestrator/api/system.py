"""A coupled system as a notebook holds it: run it, set values, put another FMU in the place of a component."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fmus.errors import MisfitError
from orchestrator.cosim.system import ComponentSpec, Connection, Value
from orchestrator.cosim.system import System as Description

if TYPE_CHECKING:
    from orchestrator.cosim.simulation import Simulation
    from orchestrator.results.result import Result


@dataclass(frozen=True, eq=False)
class System:
    """FMUs and other components that run together; never changed: `swap` and `set` give a new one.

    Args:
        source: a system file (.toml, .ssd, .ssp), one FMU, a Modelica class or a built-in; or FMUs by component name.
        connections: pairs of addresses such as `("motor.torque", "arm.tau1")`, for FMUs by name.

    Raises:
        MisfitError: if there is no such file, or it is no system.
    """

    source: Any
    connections: Sequence[tuple[str, str]] = ()
    _description: Description | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        """Read the system at once, so that what is wrong shows here."""
        if self._description is None:
            object.__setattr__(self, "_description", _described(self.source, self.connections))

    @property
    def description(self) -> Description:
        """Components, connections, inputs, outputs and how to run them."""
        assert self._description is not None
        return self._description

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components."""
        return tuple(self.description.components)

    def run(
        self,
        stop: float | None = None,
        *,
        step: float | None = None,
        master: str | None = None,
        tolerance: float | None = None,
        record: Sequence[str] | None = None,
        every: int = 1,
        isolate: bool | None = None,
    ) -> "Result":
        """Run from beginning to end.

        Args:
            stop, step: times in s; what the system says without them.
            master: ordered, jacobi, gauss_seidel, iterative or adaptive.
            tolerance: relative tolerance of FMUs and masters.
            record: patterns of the columns to record, such as `["arm.*"]`; all outputs without any.
            every: record each `every`-th communication point.
            isolate: run in a process of its own; by default FMUs do that were neither built here nor trusted.

        Returns:
            Time in s and one column `component.variable` for each recorded variable; it draws itself in a notebook.

        Raises:
            MisfitError: if the system cannot be run, or nothing says for how long.
            ComponentError: if a component fails.
        """
        from orchestrator.api.progress import progress
        from orchestrator.cosim.run import RunOptions, run_system
        from orchestrator.results.recorder import MemoryRecorder

        options = RunOptions(stop, step, master, tolerance, tuple(record) if record else None, every, isolate)
        recorder = MemoryRecorder()
        with progress() as say:
            run_system(self.description, recorder, options, lambda time: say(f"t = {time:.4g} s"))
        return recorder.result()

    def open(self, **options: Any) -> "Simulation":
        """Load the system to run it step by step, in this process; use it in a `with` statement, which ends it.

        Args:
            options: of `misfit.Simulation`: record, every, stop, step (s), master, tolerance.

        Raises:
            MisfitError: if the system cannot be run.
            ComponentError: if a component fails while it is loaded.
        """
        from orchestrator.cosim.simulation import Simulation

        return Simulation(self.description, **options)

    def swap(self, component: str, file: "str | Path", names: Mapping[str, str] | None = None) -> "System":
        """Give the system with an FMU in the place of a component.

        Args:
            component: the name of the component.
            file: the FMU.
            names: new names of variables by old ones, where they differ.

        Raises:
            MisfitError: if the FMU does not fit; the message lists why.
        """
        from orchestrator.cosim.swap import swap

        found = swap(self.description, component, Path(file), names)
        if found.system is None:
            raise MisfitError(f"{file} does not fit in the place of {component}: {found.report}")
        if found.report.questions:
            asked = "; ".join(map(str, found.report.questions))
            raise MisfitError(f"{file} in the place of {component} needs your word: {asked}; say it with names={{...}}")
        return System(self.source, self.connections, found.system)

    def set(self, values: Mapping[str, Any]) -> "System":
        """Give the system with other parameters, start values or inputs, each by `component.variable`.

        Raises:
            MisfitError: if there is no such component.
        """
        changed = self.description.with_values({address: Value(value) for address, value in values.items()})
        return System(self.source, self.connections, changed)

    def save(self, path: "str | Path") -> Path:
        """Write the system as a TOML file; FMUs stay where they are. Returns the path.

        Raises:
            MisfitError: if it cannot be written as TOML.
        """
        from fmus.files import write_atomically
        from orchestrator.cosim.toml_file import write_toml

        target, description = Path(path), self.description
        if target.suffix != ".toml":
            raise MisfitError(f"{target}: expected a file NAME.toml")
        placed = {
            name: replace(spec, source=str((description.folder / spec.source).resolve()))
            if spec.source and (description.folder / spec.source).is_file()
            else spec
            for name, spec in description.components.items()
        }
        write_atomically(target, write_toml(replace(description, components=placed)).encode())
        return target


def _described(source: Any, connections: Sequence[tuple[str, str]]) -> Description:
    from orchestrator.cosim.load import load_system

    if isinstance(source, Description):
        return source
    if isinstance(source, str | Path):
        return load_system(source)
    if isinstance(source, Mapping):
        specs = {}
        for name, file in source.items():
            path = Path(file).resolve()
            if not path.is_file():
                raise MisfitError(f"{file} does not exist; expected the FMU of component {name!r}")
            specs[name] = ComponentSpec(name, source=str(path))
        return Description("system", specs, tuple(Connection(*pair) for pair in connections))
    raise MisfitError(
        f"System({type(source).__name__}): expected the path of a system file or an FMU, or FMUs by component name"
    )
