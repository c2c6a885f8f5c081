"""The error, falling step by step towards the noise floor."""

from orchestrator.studio.live import Live
from orchestrator.studio.project import Project
from orchestrator.studio.versions import versions
from orchestrator.studio.views.page import error_steps
from orchestrator.studio.views.steps_view import StepsView


class VersionsPart:
    """The ledger as a picture; a version that is added falls from the height of the one before."""

    def __init__(self, project: Project) -> None:
        self.project = project
        self._view: StepsView | None = None
        self._seen: object = None
        self._live = Live(lambda: bool(versions(project).shown), self._build)

    def _build(self) -> None:
        shown = versions(self.project).shown
        self._seen, self._view = shown, None
        if shown:
            self._view = error_steps(shown)

    def check(self) -> None:
        """Follow the disk."""
        self._live.check()
        shown = versions(self.project).shown
        if self._view is not None and shown != self._seen:
            self._seen = shown
            self._view.show(shown)
