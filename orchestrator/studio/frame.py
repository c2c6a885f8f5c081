"""What every page stands in: a header with the navigation, the main part, and a footer."""

import inspect
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from fastapi import Request, Response
from fastapi.responses import HTMLResponse
from nicegui import app, ui

from orchestrator.report.answer.markup import answer_style
from orchestrator.report.arm_drawing import replay_script, replay_style
from orchestrator.report.palette import Colour, css_variables, dark_css
from orchestrator.studio.gate import REFUSED
from orchestrator.studio.pages import Page
from orchestrator.studio.views.parts import STYLE as VIEWS_STYLE

STYLE = Path(__file__).with_name("studio.css")
STATIC = Path(__file__).with_name("static")
# What has fixed colours is turned round in dark pages.
DRAWN = ".nicegui-echart, .steps-drawing, .arm-replay svg, .view-legend span, .bench-state, .bench-part"


def mount(pages: Sequence[Page]) -> None:
    """Give every page its route."""
    ui.add_css(css_variables() + VIEWS_STYLE.read_text() + STYLE.read_text() + answer_style(), shared=True)
    ui.add_css(replay_style() + dark_css(DRAWN), shared=True)
    ui.add_head_html(f"<script>{replay_script()}</script>", shared=True)
    app.add_static_files("/studio", STATIC)
    for script in ("upload.js", "lost.js"):
        ui.add_head_html(f'<script src="/studio/{script}" defer></script>', shared=True)
    for page in pages:
        _mount(page, pages)
    others = app.exception_handlers[404]

    @app.exception_handler(404)
    async def no_such_page(request: Request, error: Exception) -> Response:
        if "text/html" in request.headers.get("accept", ""):
            words = 'There is no such page. <a href="/">Go to the start page</a>'
            return HTMLResponse(REFUSED.format(words), 404)
        found = others(request, error)
        return await found if inspect.isawaitable(found) else found


def _mount(page: Page, pages: Sequence[Page]) -> None:
    @ui.page(page.path, title=f"{page.title} · misfit studio", dark=None)
    async def show(request: Request) -> None:
        ui.colors(primary=Colour.ACCENT, negative=Colour.BAD, positive=Colour.GOOD, warning=Colour.WARNING)
        _header(page, pages)
        with ui.element("div").classes("studio-main").props("id=content"):
            built = page.build(**request.path_params)
            if inspect.isawaitable(built):
                await built
        _footer()


def _header(shown: Page, pages: Sequence[Page]) -> None:
    with ui.header(fixed=False).classes("studio-header"):
        ui.link("Skip to the content", "#content").classes("studio-skip")
        ui.link("misfit studio", "/").classes("studio-brand")
        with ui.element("nav").props('aria-label="Pages"').classes("studio-navigation"):
            for page in pages:
                if page.order is not None:
                    link = ui.link(page.title, page.path)
                    if page is shown:
                        link.props('aria-current="page"')


def _footer() -> None:
    with ui.footer(fixed=False).classes("studio-footer"):
        ui.label(f"misfit {version('misfit-fmu')} · everything stays on this machine")
