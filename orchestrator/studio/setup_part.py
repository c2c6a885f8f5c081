"""The first part of a project: which model, which measurements."""

from functools import cache

from nicegui import run, ui
from nicegui.events import GenericEventArguments

from fmus.catalogue import built_in_models
from orchestrator.studio.names import model_words
from orchestrator.studio.pages import Live
from orchestrator.studio.project import MATCH, Project
from orchestrator.studio.receive import DATA_ENDINGS, MODEL_ENDINGS, make_way
from orchestrator.studio.text import bullets, details, drop_zone, heading, menu, paragraph, telling

# Files that are named at once; a list of hundreds would push everything else away.
FEW = 3
LONGEST_NAME = 80


@cache
def model_names() -> dict[str, str]:
    """Built-in models with their one-line descriptions."""
    return {name: f"{name}: {model.description}" for name, model in built_in_models().items()}


def setup_part(project: Project) -> list[Live]:
    """Add the part; returns what of it follows the disk."""
    with ui.element("section").classes("studio-columns").props('aria-label="Model and measurements"'):
        with ui.element("div"):
            heading("Model")
            model = _model(project)
            drop_zone(
                project,
                "model",
                "Or drop a model here, or choose one: FMU or Modelica (.mo)",
                ",".join(MODEL_ENDINGS),
                multiple=False,
            )
            _rename(project)
        with ui.element("div"):
            heading("Measurements")
            text = "Drop files here, or choose them, one trial each: csv or text of any make, parquet, mf4 or h5; or all in a zip. A case.toml is written for you, if you have none."
            drop_zone(project, "measurements", text, ",".join((*DATA_ENDINGS, ".toml", ".zip")), multiple=True)
            files = Live(lambda: tuple(map(str, project.data_files())), lambda: _files(project))
    return [model, files]


def setup_words(project: Project) -> str:
    """Model and measurements in a few words."""
    matched = project.result(MATCH)
    count, what = (len(matched["trials"]), "trial") if matched else (len(project.data_files()), "file")
    return f"Model: {model_words(project.model or 'none yet')} · {count} {what}{'' if count == 1 else 's'}"


def _rename(project: Project) -> None:
    def rename() -> None:
        project.change(name=str(field.value or "").strip()[:LONGEST_NAME] or project.name)

    field = ui.input("Name of the project", value=project.name).on("change", rename).classes("studio-name")


def _model(project: Project) -> Live:
    async def choose(event: GenericEventArguments) -> None:
        with telling():
            await run.io_bound(make_way, project)
            project.choose_model(str(event.args))

    def build() -> None:
        known = project.model in model_names()
        other = {} if known else {"": f"{model_words(project.model or 'none')} is chosen"}
        chosen = str(project.model) if known else ""
        menu("built-in", "Built-in model", other | model_names(), chosen, choose, closed=("",))
        _classes(project)

    return Live(lambda: project.model, build)


def _classes(project: Project) -> None:
    """The class of a Modelica file, where it declares several."""
    names = list(project.settings.get("classes", ()))
    file, _, chosen = (project.model or "").rpartition(":")
    if len(names) < 2 or not file.endswith(".mo"):
        return

    async def choose(event: GenericEventArguments) -> None:
        with telling():
            await run.io_bound(make_way, project)
            project.choose_model(f"{file}:{event.args}", names)

    menu("model-class", "Class of the file", {name: name for name in names}, chosen, choose)


def _files(project: Project) -> None:
    files = project.data_files()
    if not files:
        paragraph("No measurements yet.")
        return
    names = [str(file.relative_to(project.measurements)) for file in files]
    with details(", ".join(names) if len(names) <= FEW else f"{len(names)} files, {names[0]} to {names[-1]}"):
        bullets(names)

    async def clear() -> None:
        with telling():
            await run.io_bound(make_way, project)
            for file in project.data_files():
                file.unlink()
            project.forget_results()

    ui.button("Remove all measurements", on_click=clear).props("flat dense no-caps")
