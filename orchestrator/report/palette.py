"""The one palette of figures, pages, studio and notebook: colours named by what they mean.

Okabe and Ito's colour-blind-safe hues (2008), darkened where needed so that each can also carry text: at least 4.5:1 on
white (WCAG 2.1, 1.4.3). Meanings that share a value never stand in one figure; the test says which ones must differ.
"""

from collections.abc import Mapping
from enum import StrEnum


class Colour(StrEnum):
    """A colour by its meaning, as `#rrggbb`; usable wherever a text is."""

    # What data are.
    MEASURED = "#000000"
    MODEL = "#C24E00"
    IMPROVED = "#0072B2"
    RESIDUAL = "#A8478A"
    FLOOR = "#4A4A4A"
    LEARNING = MODEL
    HELD_OUT = IMPROVED
    FORCE = "#007D5A"
    MUSCLE = "#9C2F2F"
    # What to think of it.
    GOOD = FORCE
    BAD = MODEL
    WARNING = "#8F6400"
    # What a page is made of.
    INK = "#1A1A1A"
    QUIET = "#595959"
    ACCENT = IMPROVED
    OTHER = "#6E6E6E"


# Areas behind text and the lines that separate: nothing is written in them.
SURFACES = {"paper": "#FFFFFF", "tint": "#F1F6FA", "rule": "#D5D5D5", "rule-strong": "#767676"}

# For curves that are alike in kind, such as six muscles: vary the line's style, too, beyond the first four.
SERIES = (Colour.IMPROVED, Colour.MODEL, Colour.GOOD, Colour.MEASURED, Colour.RESIDUAL, "#0B3C6F")


# The same meanings on a dark page, each at least 4.5:1 on its paper and tint, too.
DARK = {
    Colour.MEASURED: "#F4F4F4",
    Colour.MODEL: "#FF9A52",
    Colour.IMPROVED: "#62B5F0",
    Colour.RESIDUAL: "#E07FC2",
    Colour.FLOOR: "#DCDCDC",
    Colour.FORCE: "#45C79C",
    Colour.MUSCLE: "#F09090",
    Colour.WARNING: "#E2B84D",
    Colour.INK: "#E8E8E8",
    Colour.QUIET: "#B2B8BE",
    Colour.OTHER: "#9AA0A6",
}
DARK_SURFACES = {"paper": "#15191E", "tint": "#1F262E", "rule": "#3D464F", "rule-strong": "#8B939B"}


def css_variables(selector: str = ":root") -> str:
    """Return a CSS rule with each colour as a variable of the same name, such as `--held-out` and `--series-1`.

    Example:
        >>> ".plot {" in css_variables(".plot"), "--held-out: #0072B2;" in css_variables()
        (True, True)
    """
    named: dict[str, str] = {name.lower().replace("_", "-"): colour for name, colour in Colour.__members__.items()}
    named |= SURFACES | {f"series-{place}": colour for place, colour in enumerate(SERIES, start=1)}
    return _rule(selector, named)


def dark_css(drawn: str) -> str:
    """Return CSS for readers whose system asks for dark pages; print stays white on paper.

    What is selected by `drawn` has fixed colours on white: its brightness is turned round, its hues stay.

    Example:
        >>> "figure img { filter: invert" in dark_css("figure img"), "--ink: #E8E8E8;" in dark_css("figure img")
        (True, True)
    """
    named = {name.lower().replace("_", "-"): DARK[colour] for name, colour in Colour.__members__.items()}
    # Wins over `:root`, wherever that stands.
    page = _rule("html:root", named | DARK_SURFACES) + " html:root { color-scheme: dark; }"
    # White turns to the dark page's paper, near enough.
    turned = f"{drawn} {{ filter: invert(0.91) hue-rotate(180deg); }}"
    white = f"{css_variables(drawn)} {drawn} {{ background: var(--paper); color: var(--ink); color-scheme: light; }}"
    return f"@media screen and (prefers-color-scheme: dark) {{ {page} {white} {turned} }}"


def _rule(selector: str, named: Mapping[str, str]) -> str:
    return f"{selector} {{ {' '.join(f'--{name}: {colour};' for name, colour in named.items())} }}"
