"""The answer, first on the page: the sentence, Add, and the four parts that support it."""

from dataclasses import replace
from typing import Any

from nicegui import ui

from orchestrator.report.answer import answer_of
from orchestrator.report.answer.markup import evidence_html, verdict_html
from orchestrator.studio import jobs
from orchestrator.studio.pages import Live
from orchestrator.studio.project import DIAGNOSIS, VERSION, Project, file_stamp
from orchestrator.studio.text import telling
from orchestrator.studio.versions import Versions, versions


class AnswerPart:
    """The verdict with its buttons, and the evidence; after Add only the words change, the pictures stay."""

    def __init__(self, project: Project) -> None:
        self.project = project
        results = project.folder / "results"
        self._box = ui.element("div").classes("answer studio-answer").props('aria-label="Answer" role=region')
        with self._box:
            self._parts = (
                Live(self._stamp, self._verdict),
                Live(lambda: file_stamp(results / DIAGNOSIS), self._evidence),
            )
        self.check()

    def check(self) -> None:
        """Follow the disk."""
        for part in self._parts:
            part.check()
        self._box.set_visibility(self.project.result(DIAGNOSIS) is not None)
        now = versions(self.project)
        # Once all is in the model, the error falls in the pictures, whose axes stay as they are.
        fallen = bool(now.number) and now.next is None
        self._box.classes(add="a-added" if fallen else "", remove="" if fallen else "a-added")

    def _stamp(self) -> object:
        running = jobs.look(self.project).running
        results = self.project.folder / "results"
        return file_stamp(results / DIAGNOSIS), versions(self.project).number, running

    def _verdict(self) -> None:
        document = self.project.result(DIAGNOSIS)
        if document is None:
            return
        now, running = versions(self.project), jobs.look(self.project).running
        with ui.element("div").classes("a-verdict"):
            ui.html(_words(document, now), sanitize=False)
            with ui.element("div").classes("studio-buttons"):
                if now.next is not None and document["effects"]:
                    self._button(_add_label(document, now), self._add, running)
                if now.number:
                    self._button("Undo", self._undo, running).props("outline")
                ui.button("Why do you think so?", on_click=_open_why).props("no-caps outline")

    def _button(self, text: str, action: Any, running: bool) -> ui.button:
        def click() -> None:
            with telling():
                action()

        button = ui.button(text, on_click=click).props("no-caps unelevated")
        button.set_enabled(not running)
        return button

    def _add(self) -> None:
        number = versions(self.project).number + 1
        self.project.change(wanted=number)
        if self.project.result(VERSION.format(number)) is None:
            jobs.start(self.project, "add", [str(number)])

    def _undo(self) -> None:
        self.project.change(wanted=versions(self.project).number - 1)

    def _evidence(self) -> None:
        document = self.project.result(DIAGNOSIS)
        if document is not None:
            ui.html(evidence_html(answer_of(document), document), sanitize=False)


def _words(document: dict[str, Any], now: Versions) -> str:
    """The verdict; once something was added, what became of the error stands in front of what is next."""
    answer = answer_of(document)
    if not now.number:
        # The studio adds one effect after the other, so that each is seen to lower the error.
        one_by_one = document["verdict"] == "named" and not _at_once(document)
        return verdict_html(replace(answer, next_step=f"Add {now.next} first.") if one_by_one else answer)
    first, last = now.shown[0], now.shown[-1]
    errors = [(each.held_out or each.learning).over_floor for each in (first, last)]
    return verdict_html(answer.added(last.name, errors[0], errors[1], now.next))


def _add_label(document: dict[str, Any], now: Versions) -> str:
    if not _at_once(document) or document["verdict"] == "ambiguous":
        return f"Add {now.next}"
    return f"Add {'it' if len(document['effects']) < 2 else 'them'} to the model"


def _at_once(document: dict[str, Any]) -> bool:
    return len(document["steps"]) <= 2


def _open_why() -> None:
    ui.run_javascript(
        "const why = document.getElementById('why'); why.open = true; why.querySelector('summary').focus();"
        "why.scrollIntoView({block: 'start'})"
    )
