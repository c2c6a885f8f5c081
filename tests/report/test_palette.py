"""The palette can be read and told apart: by everyone on white, and by those who see no red or no green."""

import itertools
import re

import numpy as np
import pytest

from orchestrator.report.palette import DARK, DARK_SURFACES, SERIES, SURFACES, Colour, css_variables, dark_css

# Simulated dichromacy in linear RGB: Machado, Oliveira and Fernandes (2009), severity 1.
SIGHT = {
    "full": np.eye(3),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
}
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = np.array([0.9505, 1.0, 1.089])
# What stands in one figure.
TOGETHER = [
    ("MEASURED", "MODEL", "IMPROVED", "RESIDUAL"),
    ("LEARNING", "HELD_OUT", "FLOOR"),
    ("RESIDUAL", "FLOOR", "IMPROVED"),
    ("GOOD", "BAD"),
    ("GOOD", "WARNING"),
    ("ACCENT", "OTHER"),
]


def linear(colour: str) -> np.ndarray:
    """Linear RGB of `#rrggbb` (IEC 61966-2-1)."""
    coded = np.array([int(colour[place : place + 2], 16) for place in (1, 3, 5)]) / 255
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)


def contrast(first: str, second: str) -> float:
    """Contrast ratio of WCAG 2.1."""
    light, dark = sorted((float(linear(c) @ TO_XYZ[1]) for c in (first, second)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def lab(colour: str, sight: str) -> np.ndarray:
    """CIELAB of a colour as seen."""
    ratio = TO_XYZ @ np.clip(SIGHT[sight] @ linear(colour), 0, 1) / WHITE
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def test_contrast_of_black_and_of_a_published_grey_on_white() -> None:
    assert contrast("#000000", "#FFFFFF") == pytest.approx(21.0)
    assert contrast("#767676", "#FFFFFF") == pytest.approx(4.54, abs=0.005)


@pytest.mark.parametrize("colour", [*Colour, *SERIES])
def test_every_colour_can_carry_text_on_white(colour: str) -> None:
    assert contrast(colour, SURFACES["paper"]) >= 4.5


@pytest.mark.parametrize("colour", [Colour.INK, Colour.QUIET, Colour.ACCENT, Colour.GOOD, Colour.RESIDUAL])
def test_text_can_be_read_on_a_tinted_area(colour: str) -> None:
    assert contrast(colour, SURFACES["tint"]) >= 4.5


@pytest.mark.parametrize("sight", SIGHT)
@pytest.mark.parametrize("names", [*TOGETHER, "SERIES"])
def test_colours_of_one_figure_differ_to_the_eye(names: tuple[str, ...] | str, sight: str) -> None:
    colours = SERIES if names == "SERIES" else [Colour[name] for name in names]
    # Two patches side by side differ clearly from about 10 on; thin lines need twice that.
    for first, second in itertools.combinations(colours, 2):
        assert np.linalg.norm(lab(first, sight) - lab(second, sight)) >= 20, (first, second)


@pytest.mark.parametrize("surface", ["paper", "tint"])
@pytest.mark.parametrize("colour", [*DARK.values()])
def test_every_colour_can_carry_text_on_a_dark_page(colour: str, surface: str) -> None:
    assert contrast(colour, DARK_SURFACES[surface]) >= 4.5


@pytest.mark.parametrize("sight", SIGHT)
@pytest.mark.parametrize("names", TOGETHER)
def test_colours_of_one_figure_differ_on_a_dark_page(names: tuple[str, ...], sight: str) -> None:
    for first, second in itertools.combinations([DARK[Colour[name]] for name in names], 2):
        assert np.linalg.norm(lab(first, sight) - lab(second, sight)) >= 20, (first, second)


def test_dark_pages_are_for_screens_and_what_was_drawn_on_white_is_turned_round() -> None:
    css = dark_css(".drawn")
    assert css.startswith("@media screen and (prefers-color-scheme: dark) {")
    page, drawn = re.findall(r"(?::root|\.drawn) \{ --[^}]*\}", css)
    assert f"--ink: {DARK[Colour.INK]};" in page and f"--paper: {DARK_SURFACES['paper']};" in page
    assert f"--ink: {Colour.INK};" in drawn and f"--paper: {SURFACES['paper']};" in drawn
    assert css.count("{") == css.count("}")


def test_each_meaning_is_a_css_variable() -> None:
    found = dict(re.findall(r"--([a-z0-9-]+): (#[0-9A-F]{6});", css_variables()))
    assert {
        name.upper().replace("-", "_"): value for name, value in found.items()
    }.items() >= Colour.__members__.items()
    assert found.keys() >= {"paper", "tint", "rule", "series-1", "series-6"}


def test_lines_without_a_colour_of_their_own_take_those_of_the_palette() -> None:
    from orchestrator.report.figures._canvas import canvas

    _, axes = canvas(1, 1, 2.0)
    drawn = [axes[0, 0].plot([0, 1], [k, k])[0] for k in range(8)]

    assert [line.get_color() for line in drawn[:6]] == list(SERIES)
    assert len({(line.get_color(), line.get_linestyle()) for line in drawn}) == 8
