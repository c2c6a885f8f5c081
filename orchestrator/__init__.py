"""Measurements, comparison, diagnosis, reports and the command line."""

from orchestrator.shown import drawn_by


def _drawings() -> None:
    from orchestrator.report.notebook import register_drawings

    register_drawings()


drawn_by(_drawings)
