"""A regression case as its file describes it: what to run, what to compare, against what; nothing is loaded yet."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from orchestrator.cosim.system import Value
from orchestrator.regress.check_tables import Formula
from orchestrator.regress.comparison import Check, Tolerance


@dataclass(frozen=True)
class Stimulus:
    """What drives the inputs of a model.

    `file` holds columns named like inputs over time (s): straight between rows, or held where `hold`; a time that occurs
    twice is a jump. `signals` are generators by input, see `generators`. `columns` maps an input to a column of the file
    where the names differ.
    """

    file: Path | None = None
    hold: bool = False
    signals: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    columns: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Reference:
    """What the results are compared with: one of a file, the FMU's own results, another model, or a measurement.

    `columns` maps a signal to a column of the file where the names differ. `trial` is the number (from 1) or the name of
    a trial, and `floors` how many standard deviations of its noise a measured signal may be away. With `points` only the
    reference's own times are compared, since it is too coarse to say anything between them.
    """

    kind: str
    source: str = ""
    columns: Mapping[str, str] = field(default_factory=dict)
    trial: int | str = 1
    floors: float = 5.0
    points: bool = False


@dataclass(frozen=True)
class CaseLimits:
    """What a case may use: `seconds` in all, `patience_s` s of silence in one call, `memory_gib` GiB; `retries` after a
    failure."""

    seconds: float = 300.0
    patience_s: float = 60.0
    memory_gib: float = 4.0
    retries: int = 0


@dataclass(frozen=True)
class Case:
    """One case.

    Args:
        name: `FILE` or `FILE/CASE`, without the ending.
        file: where it is written; the files that it names are relative to its folder.
        model: FMU, system file, built-in model or `FILE.mo:Class`, as `misfit run` takes it.
        interface: "CoSimulation", "ModelExchange" or "" for the FMU's first choice.
        start, stop, step: s; None for what the model says.
        solver_tolerance: relative tolerance that FMUs are told.
        parameters: by variable, or `component.variable` in a system.
        signals: checks by signal; empty: a tube with `tolerance` around each column of the reference.
        formulas: signals that are computed from variables, by name.
        tolerance: for signals without checks of their own.
        checks: settings of the checks of the whole model by their name, see `case_file`.
        allowed: changes of the interface that are no difference, as patterns of `VARIABLE.ASPECT`, such as `x.unit` or `*.new`.
    """

    name: str
    file: Path
    model: str
    interface: str = ""
    start: float | None = None
    stop: float | None = None
    step: float | None = None
    master: str | None = None
    solver_tolerance: float | None = None
    parameters: Mapping[str, Value] = field(default_factory=dict)
    stimulus: Stimulus = field(default_factory=Stimulus)
    reference: Reference | None = None
    signals: Mapping[str, tuple[Check, ...]] = field(default_factory=dict)
    formulas: Mapping[str, Formula] = field(default_factory=dict)
    tolerance: Tolerance = field(default_factory=Tolerance)
    checks: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    allowed: tuple[str, ...] = ()
    limits: CaseLimits = field(default_factory=CaseLimits)
    tags: tuple[str, ...] = ()

    @property
    def folder(self) -> Path:
        """Where the files that the case names are."""
        return self.file.parent

    @property
    def reference_file(self) -> Path | None:
        """The file of the reference, None where it is none."""
        kind = "" if self.reference is None else self.reference.kind
        return self.folder / self.reference.source if self.reference is not None and kind == "file" else None

    @property
    def is_built(self) -> bool:
        """Whether the model is built from Modelica first."""
        return not self.model.lower().endswith((".fmu", ".toml", ".ssd", ".ssp"))
