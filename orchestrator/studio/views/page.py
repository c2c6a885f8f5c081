"""All views of a comparison, linked, in one call."""

from collections.abc import Sequence

from nicegui import ui

from orchestrator.ledger import LedgerEntry
from orchestrator.studio.views.against import FREQUENCY
from orchestrator.studio.views.bars_view import BarsView
from orchestrator.studio.views.curves_view import CurvesView
from orchestrator.studio.views.data import ViewData
from orchestrator.studio.views.link import SelectionLink
from orchestrator.studio.views.map_view import MapView
from orchestrator.studio.views.parts import use_style
from orchestrator.studio.views.selection_view import SelectionView
from orchestrator.studio.views.steps_view import StepsView


def comparison_views(data: ViewData, before: SelectionLink | None = None) -> SelectionLink:
    """Add the views of a comparison to the present container; returns their link.

    Give the link of the views that stood there `before`, and what was selected stays selected.
    """
    use_style()
    link = SelectionLink(data, before)
    SelectionView(link)
    CurvesView(link)
    MapView(link)
    with ui.element("div").classes("view-pair"):
        BarsView(link, FREQUENCY)
        BarsView(link)
    return link


def error_steps(entries: Sequence[LedgerEntry]) -> StepsView:
    """Add the picture of a ledger to the present container."""
    use_style()
    return StepsView(entries)
