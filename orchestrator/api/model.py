"""A model as a notebook holds it: compare, diagnose, add what is missing, export."""

import shutil
import tempfile
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from fmus.errors import MisfitError
from orchestrator.api.data import Data, as_data
from orchestrator.api.progress import progress

if TYPE_CHECKING:
    from fmus.catalogue import ModelicaModel
    from orchestrator.api.block import Block
    from orchestrator.api.missing import Missing
    from orchestrator.blackbox.source import Source
    from orchestrator.compare.result import Comparison
    from orchestrator.library.cards import EffectCard
    from orchestrator.models.contract import Model as Runnable
    from orchestrator.report.arm_drawing import Replay
    from orchestrator.verdicts.result import Adjusted, Diagnosis, NamedEffect
    from orchestrator.versions import Version

CLOSED = (".fmu", ".toml", ".ssd", ".ssp")
# Seconds of work show progress; two fits at a time suit any machine.
WORKERS = 2


@dataclass(frozen=True, eq=False)
class Model:
    """A physics model: a built-in, a Modelica class `FILE.mo:Class`, an FMU, or a coupled system (.toml, .ssd, .ssp).

    A model is never changed: `add` gives a new one.

    Args:
        name: the model's name or path.

    Raises:
        MisfitError: if there is no such model, or it cannot be read.
    """

    name: str
    _version: "Version | None" = field(default=None, repr=False)
    # A closed model offers places for effects for the data that it was diagnosed with last; the base keeps its files alive.
    _last: dict[str, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        """Refuse what is no model at once, and not when it is used."""
        if not isinstance(self.name, str | Path):
            raise MisfitError(
                f"Model({type(self.name).__name__}): expected the name of a built-in, FILE.mo:Class, an .fmu or a system file"
            )
        object.__setattr__(self, "name", str(self.name))
        if self._version is None:
            if self.is_closed and not Path(self.name).is_file():
                raise MisfitError(f"{self.name} does not exist; expected an FMU or a system file")
            if not self.is_closed:
                self._modelica().compile()

    @property
    def is_closed(self) -> bool:
        """Whether its equations are closed: an FMU or a coupled system, to which effects are attached from outside."""
        return self.name.lower().endswith(CLOSED) if self._version is None else self._version.file.suffix != ".fmu"

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return tuple(variable.name for variable in self._runnable().inputs)

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return tuple(variable.name for variable in self._runnable().outputs)

    def compare(self, data: Any, *, workers: int = WORKERS) -> "Comparison":
        """Run the model freely along every trial and measure its errors against the noise floor.

        Args:
            data: `misfit.Data`, a path, a mapping of arrays or a data frame.
            workers: trials that run at a time.

        Raises:
            MisfitError: if columns and variables do not fit each other.
            ComponentError: if the model fails while it runs.
        """
        from orchestrator.compare.comparison import compare

        trials, model = self._checked(data)
        with progress() as say:
            say("running the model along every trial")
            return compare(model, trials.measurements, workers=workers)

    def diagnose(
        self,
        data: Any,
        *,
        only: Sequence[str] | None = None,
        tolerances: Mapping[str, float] | None = None,
        cards: Sequence[str | Path] = (),
        workers: int = WORKERS,
        laws: bool | None = None,
    ) -> "Diagnosis":
        """Find which physical effects the model lacks to explain the data.

        Args:
            data: as for `compare`; learning and held-out trials are needed.
            only: ids of the effects to look for, such as `["coulomb_friction"]`; the whole library without it.
            tolerances: relative standard deviations of the model's parameters, such as `{"linkage.m": 0.05}`; these are
                refitted together with the effects. The name `default` stands for all others.
            cards: folders with effect cards of your own, law cards among them.
            workers: fits that run at a time; the result does not depend on it.
            laws: whether to look for a formula (`laws` of the result) where no card fits; by default where the answer
                leaves something open.

        Raises:
            MisfitError: if the data do not fit the model, or an id is unknown.
            ComponentError: if the model itself cannot be simulated.
        """
        from orchestrator.explain import explain
        from orchestrator.greybox.laws import own_laws

        trials, _ = self._checked(data)
        measurements = trials.measurements.with_tolerances(dict(tolerances or {}))
        with progress() as say:
            source = self._source(trials)
            own, library = own_laws([Path(folder) for folder in cards]), chosen_cards(only, cards)
            return explain(source, measurements, None, laws, cards=library, workers=workers, progress=say, own=own)

    def add(self, effects: Any, *, cards: Sequence[str | Path] = ()) -> "Model":
        """Give the model with effects in it.

        Args:
            effects: the `effects` of a diagnosis, one of them, one of its `laws`, an effect id such as
                `"coulomb_friction"` (with the values that its card guesses), a list of these, or a whole diagnosis,
                whose refitted parameters are then taken over, too.
            cards: folders with effect cards of your own.

        Raises:
            MisfitError: if there is nothing to add, an effect is unknown, or the model has no place for it.
        """
        from orchestrator.greybox.laws import own_laws
        from orchestrator.laws.proposal import LawProposal
        from orchestrator.versions import add_effects, default_effect

        library = chosen_cards(None, cards)
        laws = own_laws([Path(folder) for folder in cards])
        if isinstance(effects, LawProposal):
            laws, effects = (effects.law, *laws), effects.effects
        wanted, adjusted, data = _wanted(effects)
        source = self._source(data)
        named = [default_effect(source, each, library) if isinstance(each, str) else each for each in wanted]
        folder = Path(tempfile.mkdtemp(prefix="misfit-"))
        version = add_effects(source, named, folder, library, adjusted, laws)
        better = Model(version.source.name, version)
        better._last["base"] = self
        weakref.finalize(better, shutil.rmtree, folder, ignore_errors=True)
        return better

    def save_law(self, law: Any, folder: str | Path) -> Path:
        """Write one of the `laws` of a diagnosis as a card, with its Modelica class and its picture.

        Args:
            law: one of the `laws`.
            folder: where to; as one of the `cards` of later diagnoses it gives them the law.

        Returns:
            The card.

        Raises:
            MisfitError: if it is no law.
        """
        from orchestrator.laws.card import write_files
        from orchestrator.laws.proposal import LawProposal

        if not isinstance(law, LawProposal):
            raise MisfitError(f"save_law takes one of the laws of a diagnosis, not {type(law).__name__}")
        return Path(write_files(law, Path(folder)).card)

    def missing(self, data: Any) -> "Missing":
        """Show the force (or other input of a balance equation) that would make the model follow each trial.

        Raises:
            MisfitError: if the model does not show which force it lacks; the message says what it would take.
        """
        from orchestrator.api.missing import missing

        trials, _ = self._checked(data)
        if self._version is None and self.is_closed:
            from orchestrator.diagnosis.fit.extensible import model_of

            source = self._source(trials)
            return missing(model_of(source, source.compile()), trials)
        return missing(self._runnable(), trials)

    def replay(self, data: Any) -> "Replay":
        """Show a planar arm in motion along the trial that it follows worst; it moves in a trusted notebook.

        Raises:
            MisfitError: if the model is no planar arm whose equations are known.
        """
        from orchestrator.report.arm_replay import arm_replay

        trials, model = self._checked(data)
        found = arm_replay(model, trials.measurements, self.compare(trials))
        if found is None:
            raise MisfitError(f"{self.name} is no planar arm with known equations, so there is nothing to replay")
        return found

    def learn(self, data: Any, *, most: int = 300) -> "Block":
        """Learn the force that the model lacks as a Gaussian process over its positions, speeds and drives.

        Args:
            data: as for `compare`; learning trials are learned from.
            most: data for each output; longer records are taken at longer intervals.

        Raises:
            MisfitError: if there is no learning trial, the model does not show which force it lacks, or a block does
                not make free runs along the held-out trials better; the message says why.
        """
        from orchestrator.api.block import Block
        from orchestrator.datacheck.holding import with_interpolation
        from orchestrator.gp.from_trials import learn_missing
        from orchestrator.model_argument import with_forces

        trials, model = self._checked(data)
        if self.is_closed:
            raise MisfitError(
                f"{self.name}: the force that a closed model lacks cannot be learned; name its Modelica class"
            )
        if self._version is None:
            model = with_forces(self._modelica(), self.name)
        trials = replace(trials, measurements=with_interpolation(model, trials.measurements))
        bound = trials.bound(model.inputs, [v for v in model.outputs if v.name in model.signals])  # type: ignore[attr-defined]
        with progress() as say:
            say("finding the missing force along every trial")
            learned = learn_missing(model.restricted(bound.output_names), bound, most)  # type: ignore[attr-defined]
        if learned.block is None:
            reason = learned.judgement.reason if learned.judgement else "the trials need no function of its inputs"
            raise MisfitError(f"{self.name}: no block was learned: {reason}")
        return Block(learned.block)

    def to_fmu(self, path: "str | Path", *, fmi_version: str = "2.0") -> Path:
        """Write the model as an FMU for co-simulation and model exchange; returns its path.

        Args:
            path: the file, `NAME.fmu`.
            fmi_version: `"2.0"` or `"3.0"`.

        Raises:
            MisfitError: if the model is a coupled system, or the file cannot be written.
        """
        from fmus.package import build_fmu
        from fmus.reference_files import reference_files

        target = _target(path, ".fmu")
        if self._version is None and self.name.lower().endswith(".fmu"):
            shutil.copyfile(self.name, target)
            return target
        if self.is_closed:
            raise MisfitError(
                f"{self.name} is a coupled system; write it with to_system(PATH) and run it with misfit run"
            )
        source = self._modelica()
        system, stop, step = source.compile(), source.stop_time_s, source.step_size_s
        extra = reference_files(system, stop, step)
        return build_fmu(system, target, stop_time=stop, step_size=step, extra_files=extra, fmi_version=fmi_version)

    def to_modelica(self, path: "str | Path") -> Path:
        """Write the model as one Modelica file whose class is named as the file; returns its path.

        Raises:
            MisfitError: if the model's equations are closed, or the file's name is none of a class.
        """
        from orchestrator.api.modelica import write_modelica

        target = _target(path, ".mo")
        if self.is_closed:
            raise MisfitError(
                f"{self.name} has no Modelica text: its equations are closed; write it with to_system(PATH)"
            )
        return write_modelica(self._modelica(), target)

    def to_system(self, path: "str | Path") -> Path:
        """Write a coupled system, with the FMUs that it names beside it; returns the path of the TOML file.

        Raises:
            MisfitError: if the model is no coupled system.
        """
        target = _target(path, ".toml")
        if self._version is None or self._version.file.suffix != ".toml":
            raise MisfitError(
                f"{self.name} is no system that effects were added to; write it with to_fmu or to_modelica"
            )
        target.parent.mkdir(parents=True, exist_ok=True)
        for file in sorted(self._version.file.parent.iterdir()):
            if file.is_file() and file != self._version.file:
                shutil.copyfile(file, target.parent / file.name)
        shutil.copyfile(self._version.file, target)
        return target

    def _checked(self, data: Any) -> "tuple[Data, Runnable]":
        trials, model = as_data(data), self._runnable()
        trials.check(model.inputs, model.outputs)
        self._last["data"] = trials
        return trials, model

    def _runnable(self) -> "Runnable":
        from orchestrator.model_argument import load_model

        return load_model(self.name) if self._version is None else self._version.model

    def _modelica(self) -> "ModelicaModel":
        """The class of a model whose equations are open."""
        from orchestrator.model_argument import load_modelica

        return load_modelica(self.name) if self._version is None else cast("ModelicaModel", self._version.source)

    def _source(self, data: Data | None) -> "Source":
        from orchestrator.model_argument import is_open, load_modelica, load_source

        if self._version is not None:
            return self._version.source
        shown = data or self._last.get("data")
        if shown is None and is_open(self.name):
            return load_modelica(self.name)
        if shown is None:
            raise MisfitError(
                f"{self.name}: where effects can act on a closed model depends on the data; compare or diagnose it first"
            )
        return load_source(self.name, shown.measurements)


def as_model(given: Any) -> Model:
    """A model as it is, or by its name or path.

    Raises:
        MisfitError: for anything else.
    """
    if isinstance(given, Model):
        return given
    if isinstance(given, str | Path):
        return Model(str(given))
    raise MisfitError(
        f"a {type(given).__name__} is no model; expected misfit.Model, a name, FILE.mo:Class or the path of an FMU or a system"
    )


def chosen_cards(only: Sequence[str] | None, folders: Sequence[str | Path]) -> "tuple[EffectCard, ...]":
    """Cards of the library and of the user's folders, or those with the given ids.

    Raises:
        MisfitError: if an id is unknown.
    """
    from orchestrator.library.cards import effect_library
    from orchestrator.measurements.wording import nearest

    library = tuple(effect_library([Path(folder) for folder in folders]))
    if only is None:
        return library
    wanted = [only] if isinstance(only, str) else list(only)
    known = list(dict.fromkeys(card.id for card in library))
    for name in wanted:
        if name not in known:
            raise MisfitError(f"there is no effect {name!r}; {nearest(str(name), known)}")
    return tuple(card for card in library if card.id in wanted)


def _wanted(effects: Any) -> "tuple[list[NamedEffect | str], Sequence[Adjusted], Data | None]":
    """Effects in any form, refitted parameters, and the data of a diagnosis."""
    from orchestrator.verdicts.result import Diagnosis, NamedEffect

    adjusted: Sequence[Adjusted] = ()
    data = None
    if isinstance(effects, Diagnosis):
        adjusted, found = effects.adjusted, list[Any](effects.effects)
        data = Data.read(effects.data) if Path(effects.data).exists() else None
    elif isinstance(effects, str | NamedEffect):
        found = [effects]
    elif isinstance(effects, Sequence):
        found = list(effects)
    else:
        raise MisfitError(f"add({type(effects).__name__}): expected the effects of a diagnosis, or effect ids")
    for each in found:
        if not isinstance(each, str | NamedEffect):
            raise MisfitError(f"add: {each!r} is no effect; expected the effects of a diagnosis, or effect ids")
    if not found:
        raise MisfitError("add: there are no effects to add; the diagnosis named none")
    return found, adjusted, data


def _target(path: "str | Path", ending: str) -> Path:
    target = Path(path)
    if target.suffix != ending:
        raise MisfitError(f"{target}: expected a file NAME{ending}")
    target.parent.mkdir(parents=True, exist_ok=True)
    return target
