"""What a job does: the same calls as the command line, with results written to the project's folder."""

import json
import os
import pickle
import re
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.compare.comparison import compare as compare_with
from orchestrator.compare.result import Comparison
from orchestrator.measurements import MeasurementSet, bind, load_measurements
from orchestrator.measurements.case_file import read_case_file
from orchestrator.measurements.dirty.plan import Wishes, proposed_plan
from orchestrator.measurements.dirty.write import MADE, write_plan
from orchestrator.model_argument import load_model, load_source
from orchestrator.studio.names import model_words
from orchestrator.studio.project import (
    COMPARISON,
    COMPARISON_REPORT,
    DIAGNOSIS,
    MATCH,
    REPLAY,
    REPORT,
    VERSION,
    VIEWS,
    Project,
)

if TYPE_CHECKING:
    from orchestrator.models.contract import Model
    from orchestrator.report.arm_drawing import Replay
    from orchestrator.verdicts.result import Diagnosis

Say = Callable[[str], None]
PICKLE = "diagnosis.pickle"
WORKERS = os.cpu_count() or 1


def match(project: Project, say: Say) -> None:
    """Read the measurements and find out which column is which variable of the model."""
    from orchestrator.studio.columns import column_rows, trial_rows

    model = None
    if project.model is not None:
        say(f"building {model_words(_model(project))}")
        model = load_model(project.model)
    imported = _imported(project, model, say)
    measurements = _measurements(project, say)
    document: dict[str, Any] = {
        "model": project.model,
        "columns": column_rows(measurements, model),
        "trials": trial_rows(measurements),
        "notes": [*imported, *measurements.notes],
        "problem": "",
        # What the menus offer; nothing where somebody's own case.toml says what the columns are.
        "variables": [v.name for v in (*model.inputs, *model.outputs)]
        if model is not None and own_case(project)
        else [],
        "inputs": [v.name for v in model.inputs] if model is not None else [],
        "own_case": own_case(project),
    }
    if model is not None:
        say("matching columns and variables")
        try:
            document["notes"] += bind(measurements, model.inputs, model.outputs).notes
        except MisfitError as error:
            # Where the studio writes case.toml itself, the menus say what is to be said in it.
            told = str(error).removeprefix(f"{measurements.path}: ")
            problem = re.sub(r";[^;]*case\.toml.*", "; choose variable and unit below", told)
            document["problem"] = problem if document["own_case"] else told
    _write(project, MATCH, document)


def own_case(project: Project) -> bool:
    """Whether case.toml is the studio's own, which it writes again when a menu changes."""
    case = project.measurements / "case.toml"
    return not case.is_file() or case.read_text(errors="replace").startswith(MADE)


def _imported(project: Project, model: "Model | None", say: Say) -> list[str]:
    """Write case.toml for files as they are, unless the user gave one; returns what was assumed."""
    files = [file for file in project.data_files() if file.name != "case.toml"]
    if not files or not own_case(project) or any(file.parent != project.measurements for file in files):
        return []
    say("looking at how the files are made")
    plan = proposed_plan(
        [project.measurements],
        model.inputs if model else (),
        model.outputs if model else (),
        Wishes(**project.wishes),  # type: ignore[arg-type]
    )
    write_plan(plan, project.measurements)
    return list(plan.notes)


def compare(project: Project, say: Say) -> None:
    """Run the model along every trial."""
    from orchestrator.report.html import comparison_report

    measurements = _measurements(project, say)
    say(f"building {model_words(_model(project))}")
    model = load_model(_model(project))
    say("running the model along every trial")
    found = compare_with(model, measurements, workers=WORKERS)
    _show(project, found, 0)
    replay = _replay(project, measurements, found)
    write_atomically(project.results / COMPARISON_REPORT, comparison_report(found, replay).encode())
    _write(project, COMPARISON, found.to_json())


def diagnose(project: Project, say: Say) -> None:
    """Find the missing effects, and record the model as given in the ledger."""
    from orchestrator.diagnosis.fit.extensible import model_of
    from orchestrator.discover import record
    from orchestrator.explain import explain
    from orchestrator.report.html import diagnosis_report
    from orchestrator.report.sentences import verdict_sentence
    from orchestrator.work import resumable

    measurements = _measurements(project, say)
    say(f"building {model_words(_model(project))}")
    source = load_source(_model(project), measurements)
    with resumable(f"{project.folder} {measurements.content_hash}") as work:
        found = explain(source, measurements, project.results, workers=WORKERS, progress=say, work=work)
    given = found.steps[0].comparison
    for number, step in enumerate(found.steps):
        _show(project, step.comparison, number)
    record(project.results, source.name, source, model_of(source, source.compile()), (), given, measurements)
    if found.experiment_csv is not None:
        write_atomically(project.results / "next_experiment.csv", found.experiment_csv.encode())
    replay = _replay(project, measurements, given)
    write_atomically(project.results / REPORT, diagnosis_report(found, replay).encode())
    # The report of a model with effects in it shows the whole diagnosis, of which JSON keeps but a part.
    write_atomically(project.results / PICKLE, pickle.dumps(found))
    _write(project, COMPARISON, given.to_json())
    _write(project, DIAGNOSIS, found.to_json() | {"sentence": verdict_sentence(found)})


def add(project: Project, say: Say, number: str) -> None:
    """Build the model with the first `number` steps of the diagnosis, and compare it as the one before."""
    from orchestrator import ledger
    from orchestrator.discover import record
    from orchestrator.report.html import discovery_report
    from orchestrator.verdicts.read_back import adjusted_of, effects_of
    from orchestrator.versions import add_effects

    diagnosis = project.result(DIAGNOSIS)
    if diagnosis is None:
        raise MisfitError("there is no diagnosis of this model and these measurements yet; press Diagnose first")
    step = diagnosis["steps"][int(number)]
    measurements = _measurements(project, say)
    measurements = replace(measurements, interpolation=diagnosis.get("interpolation", measurements.interpolation))
    source = load_source(_model(project), measurements)
    effects = effects_of(step)
    say(f"building the model with {' + '.join(effect.id for effect in effects)}")
    version = add_effects(source, effects, project.results / "versions", adjusted=adjusted_of(step["adjusted"]))
    say("running it along every trial")
    found = compare_with(version.model, measurements, workers=WORKERS, floor=diagnosis["noise_floor"])
    entry = record(project.results, version.source.name, version.source, version.model, effects, found, measurements)
    whole: Diagnosis = pickle.loads((project.results / PICKLE).read_bytes())
    known = ledger.read(project.results)
    earlier = [project.result(VERSION.format(k)) for k in range(1, int(number))]
    shown = [known[0], *(known[each["entry"]] for each in earlier if each), entry]
    replay = _replay(project, measurements, whole.steps[0].comparison)
    if int(number) == len(diagnosis["steps"]) - 1:
        whole = replace(whole, patched_model=str(version.file))
    write_atomically(project.results / REPORT, discovery_report(whole, shown, replay).encode())
    _write(project, VERSION.format(number), {"entry": entry.version, "comparison": found.to_json()})


def swap(project: Project, say: Say) -> None:
    """Compare two FMUs with each other."""
    from orchestrator.studio.swap_task import swap as run

    run(project, say)


TASKS: dict[str, Callable[..., None]] = {
    "match": match,
    "compare": compare,
    "diagnose": diagnose,
    "add": add,
    "swap": swap,
}


def _model(project: Project) -> str:
    if project.model is None:
        raise MisfitError("no model is chosen; choose a built-in one or drop in an FMU")
    return project.model


def _measurements(project: Project, say: Say) -> MeasurementSet:
    """The project's measurements; a case.toml that somebody else wrote must not lead to other files of this machine."""
    say("reading the measurements")
    folder = project.measurements
    case = folder / "case.toml"
    if case.is_file():
        data = tuple(file.name for file in project.data_files() if file != case)
        for name in read_case_file(Path("case.toml"), case.read_bytes(), data).files:
            if not (folder / name).resolve().is_relative_to(folder.resolve()):
                raise MisfitError(
                    f"case.toml: files holds {name!r}, which is outside the project; upload that file, too"
                )
    # The folder is the present one, and a name without its path is what reports shall show.
    return load_measurements(Path(folder.name))


def _replay(project: Project, measurements: MeasurementSet, given: Comparison) -> "Replay | None":
    """The motion of the model as given along its worst trial, made once for page and reports; None for other models."""
    from orchestrator.report.arm_replay import arm_replay
    from orchestrator.report.pictures import moving

    kept = project.results / "replay.pickle"
    if not kept.exists():
        replay = arm_replay(load_model(_model(project)), measurements, given)
        write_atomically(kept, pickle.dumps(replay))
        if picture := moving(replay):
            _write(project, REPLAY, {"markup": picture.image, "caption": picture.caption})
    found: Replay | None = pickle.loads(kept.read_bytes())
    return found


def _show(project: Project, comparison: Comparison, number: int) -> None:
    """Leave the curves of a version for the linked views."""
    from orchestrator.studio.views.store import write

    folder = project.results / VIEWS.format(number)
    shutil.rmtree(folder, ignore_errors=True)
    write(folder, comparison)


def _write(project: Project, name: str, document: dict[str, Any]) -> None:
    write_atomically(project.results / name, (json.dumps(document, indent=1, allow_nan=False) + "\n").encode())
