"""The planar arm as a picture: one instant as SVG, a motion as a replay; the same for report, notebook, studio and bench."""

from orchestrator.report.arm_drawing.arrows import Scales
from orchestrator.report.arm_drawing.curves import Line, Panel
from orchestrator.report.arm_drawing.replay import Replay, replay_html, replay_script, replay_style, script_source
from orchestrator.report.arm_drawing.shape import NOMINAL_ARM, ArmShape, Instant
from orchestrator.report.arm_drawing.svg import arm_svg

__all__ = [
    "NOMINAL_ARM",
    "ArmShape",
    "Instant",
    "Line",
    "Panel",
    "Replay",
    "Scales",
    "arm_svg",
    "replay_html",
    "replay_script",
    "replay_style",
    "script_source",
]
