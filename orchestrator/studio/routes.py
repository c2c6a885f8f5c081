"""Plain routes of the studio beside its pages: upload and download."""

import io
import zipfile
from pathlib import Path

from fastapi import Request
from fastapi.responses import FileResponse, PlainTextResponse, Response
from nicegui import app

from fmus.errors import MisfitError
from orchestrator.report.arm_drawing import script_source
from orchestrator.studio.project import COMPARISON_REPORT, REPORT, Project
from orchestrator.studio.receive import receive
from orchestrator.studio.workspace import Workspace

REPORTS = (REPORT, COMPARISON_REPORT)
# A report is a document of its own: it runs no script but that of its replay, and reaches nothing of the studio.
REPORT_POLICY = (
    f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src {script_source()}; "
    "sandbox allow-scripts; frame-ancestors 'self'"
)


def mount(workspace: Workspace) -> None:
    """Add the routes."""

    @app.put("/project/{id}/upload/{kind}")
    async def upload(id: str, kind: str, name: str, request: Request) -> Response:
        try:
            return PlainTextResponse(await receive(workspace.project(id), kind, name, request.stream()))
        except MisfitError as error:
            return PlainTextResponse(" ".join(str(error).split()), 400)

    @app.get("/project/{id}/download/{name}")
    def download(id: str, name: str) -> Response:
        try:
            return _download(workspace.project(id), name)
        except MisfitError as error:
            return PlainTextResponse(str(error), 404)


def _download(project: Project, name: str) -> Response:
    if name in REPORTS and (file := project.results / name).is_file():
        return FileResponse(file, media_type="text/html", headers={"Content-Security-Policy": REPORT_POLICY})
    if name == "everything.zip":
        headers = {"Content-Disposition": 'attachment; filename="misfit-results.zip"'}
        return Response(_zipped(project), media_type="application/zip", headers=headers)
    for file in downloads(project):
        if file.name == name:
            return FileResponse(file, media_type="application/octet-stream", filename=name)
    raise MisfitError(f"the project has no file {name!r} to download")


def downloads(project: Project) -> list[Path]:
    """Files that the project offers: models with effects, results, and the inputs of the next experiment."""
    names = (*REPORTS, "comparison.json", "diagnosis.json", "ledger.jsonl", "next_experiment.csv")
    found = [project.results / name for name in names]
    versions = project.results / "versions"
    found += sorted(versions.iterdir()) if versions.is_dir() else []
    return [file for file in found if file.is_file() and not file.is_symlink()]


def _zipped(project: Project) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in downloads(project):
            archive.write(file, file.name)
    return stream.getvalue()
