"""What can be taken away: models with effects, the report, results."""

from nicegui import ui

from orchestrator.studio.live import Live
from orchestrator.studio.project import Project, file_stamp
from orchestrator.studio.routes import REPORTS, downloads
from orchestrator.studio.text import heading

MEANING = {
    ".fmu": "the model with the effect in it, as FMU",
    ".mo": "the same as Modelica",
    ".toml": "the system of the FMU and its effects",
    ".html": "report, self-contained; it prints well",
    ".json": "machine-readable result",
    ".jsonl": "all versions with their errors",
    ".csv": "inputs of the next experiment",
}


def downloads_part(project: Project) -> Live:
    """Add the part."""
    return Live(lambda: tuple((f.name, file_stamp(f)) for f in downloads(project)), lambda: _build(project))


def _build(project: Project) -> None:
    files = downloads(project)
    if not files:
        return
    heading("Take away")
    address = f"/project/{project.id}/download"
    with ui.element("ul").classes("studio-files"):
        for file in sorted(files, key=lambda file: list(MEANING).index(file.suffix) if file.suffix in MEANING else 9):
            with ui.element("li"):
                ui.link(file.name, f"{address}/{file.name}", new_tab=file.name in REPORTS)
                ui.label(MEANING.get(file.suffix, "part of the system")).classes("studio-hint")
    ui.link("All of them in a zip", f"{address}/everything.zip")
