"""A place to drop files, or to choose them with keyboard or mouse; `static/upload.js` sends them."""

from nicegui import ui

from orchestrator.studio.project import Project
from orchestrator.studio.receive import upload_limit


def drop_zone(project: Project, kind: str, text: str, endings: str, *, multiple: bool, home: str = "project") -> None:
    """Add the zone and the line that tells what became of the files; `home` is the first part of the address that takes them."""
    status = f"sent-{kind}"
    with ui.element("div").classes("studio-drop"):
        with ui.element("label").props(f'for="choose-{kind}"'):
            ui.html(text, sanitize=False, tag="span")
        chooser = ui.element("input").props(f'type=file id="choose-{kind}" accept="{endings}"')
        chooser.props["data-upload"] = f"/{home}/{project.id}/upload/{kind}"
        chooser.props["data-status"] = status
        chooser.props["data-limit"] = upload_limit()
        if multiple:
            chooser.props["multiple"] = True
    ui.element("p").props(f'id="{status}" role=status').classes("studio-told")
