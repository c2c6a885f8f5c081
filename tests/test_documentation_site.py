"""The documentation site: complete, without a dead link, without the network, and readable for everybody."""

import fcntl
import html
import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

from docs.generator.effect_pages import by_id
from docs.generator.toml_pages import TOML_FILES
from orchestrator.greybox.laws import laws
from orchestrator.library.cards import effect_library
from orchestrator.report.palette import SURFACES, Colour

ROOT = Path(__file__).parents[1]
CSS = ROOT / "docs" / "assets" / "site.css"
PAGE_TYPES = (
    "index.html",
    "tutorials/name_an_effect.html",
    "effects/index.html",
    "effects/coulomb_friction.html",
    "reference/commands.html",
    "reference/json_documents.html",
    "reference/python.html",
    "benchmarks/diagnosis.html",
)


class Parts(HTMLParser):
    """What a page links to, loads, shows as pictures and can be linked at."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.pictures: list[dict[str, str]] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {name: value or "" for name, value in attrs}
        self.ids |= {found[name] for name in ("id", "name") if name in found}
        if tag == "a" and "href" in found:
            self.links.append(found["href"])
        elif tag == "link" and found.get("rel") not in ("prev", "next", "canonical"):
            self.loaded.append(found.get("href", ""))
        self.loaded += [found[name] for name in ("src", "srcset", "data", "poster") if name in found]
        if tag == "img":
            self.pictures.append(found)


@cache
def parts(page: Path) -> Parts:
    return Parts(page.read_text())


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built once for all workers of a test run."""
    base = tmp_path_factory.getbasetemp()
    shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder = shared / "documentation-site"
    with (shared / "documentation-site.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / "external_links.txt").is_file():
            command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
            # test_studio_pictures.py takes the pictures of the studio, which last longer than all the rest.
            quiet = {"NO_MKDOCS_2_WARNING": "1", "MISFIT_PICTURES": "no"}
            done = subprocess.run(
                command, cwd=ROOT, env=os.environ | quiet, capture_output=True, text=True, check=False
            )
            assert done.returncode == 0, done.stdout + done.stderr
    return folder


def pages(site: Path) -> list[Path]:
    found = sorted(page for page in site.rglob("*.html") if page.name != "404.html")
    assert found
    return found


def test_every_link_within_the_site_leads_to_a_page_and_a_place_that_exist(site: Path) -> None:
    dead = []
    for page in pages(site):
        for link in parts(page).links:
            if re.match(r"[a-z]+:", link):
                continue
            path, _, anchor = unquote(link).partition("#")
            target = (page.parent / path).resolve() if path else page
            target = target / "index.html" if target.is_dir() else target
            if not target.is_file() or (anchor and target.suffix == ".html" and anchor not in parts(target).ids):
                dead.append(f"{page.relative_to(site)}: {link}")

    assert dead == []


def test_pages_and_styles_load_nothing_from_the_network(site: Path) -> None:
    loaded = [f"{page.name}: {each}" for page in pages(site) for each in parts(page).loaded]
    styles = [
        f"{f.name}: {each}" for f in site.rglob("*.css") for each in re.findall(r"(?:url|@import)[^;)]*", f.read_text())
    ]

    assert [each for each in (*loaded, *styles) if re.search(r"https?:|[\"'(: ]//", each)] == []


def test_links_that_leave_the_site_are_listed(site: Path) -> None:
    listed = (site / "external_links.txt").read_text().split()
    found = {link for page in pages(site) for link in parts(page).links if link.startswith("http")}

    assert set(listed) == found


def test_every_page_of_the_documentation_is_in_the_navigation(site: Path) -> None:
    written = {path.relative_to(ROOT / "docs").with_suffix(".html") for path in (ROOT / "docs").rglob("*.md")}
    named = {Path(os.path.normpath(unquote(link.partition("#")[0]))) for link in navigation(site / "index.html")}

    assert written - named == set()


def navigation(page: Path) -> list[str]:
    menu = re.search(r"<nav class=\"md-nav md-nav--primary.*?</nav>\s*</div>", page.read_text(), re.DOTALL)
    assert menu
    return Parts(menu.group(0)).links


def test_every_picture_says_what_it_shows(site: Path) -> None:
    silent = [
        f"{p.name}: {i.get('src', '')[:60]}"
        for p in pages(site)
        for i in parts(p).pictures
        if len(i.get("alt", "")) < 10
    ]

    assert silent == []


@pytest.mark.parametrize("effect", sorted({card.id for card in effect_library()}))
def test_every_effect_of_the_library_has_a_complete_page(site: Path, effect: str) -> None:
    text = (site / "effects" / f"{effect}.html").read_text()
    page = parts(site / "effects" / f"{effect}.html")
    for scene in by_id()[effect]:
        card = scene.card
        assert {
            f"{scene.name}-{part}"
            for part in ("equation", "parameters", "signature", "confused", "experiment", "sites")
        } <= page.ids
        for parameter in card.parameters:
            assert f"<td><code>{parameter.name}</code></td>" in text
        assert {f"{other}.html" for other in card.confusable} <= set(page.links)
        assert card.experiment[1:] in text
        assert any(image["src"] == f"img/{scene.name}.png" for image in page.pictures)
        assert (site / "effects" / "img" / f"{scene.name}.png").stat().st_size > 5_000
    assert text.count('<details class="note">') == len(by_id()[effect])


def test_every_command_with_every_option_is_in_the_reference(site: Path) -> None:
    import click

    from orchestrator.cli.main import misfit

    text = (site / "reference" / "commands.html").read_text()
    context = click.Context(misfit)
    for name in misfit.list_commands(context):
        command = misfit.get_command(context, name)
        assert command is not None
        for each in leaves(command):
            for option in each.params:
                if isinstance(option, click.Option) and not option.hidden:
                    assert option.opts[0] in text, f"misfit {name} {option.opts[0]}"


def leaves(command: Any) -> Iterator[Any]:
    """The commands of a group, or the command itself."""
    for each in getattr(command, "commands", {}).values():
        yield from leaves(each)
    if not hasattr(command, "commands"):
        yield command


@pytest.mark.parametrize(
    ("schema", "command"),
    [
        ("misfit.compare/1", ["compare", "pendulum", "tests/cases/pendulum"]),
        ("misfit.run/1", ["run", "drive", "--stop", "0.01"]),
        ("misfit.regress/1", ["regress", "tests/cases/regress", "-k", "pendulum"]),
    ],
)
def test_documents_have_the_keys_of_the_reference(site: Path, schema: str, command: list[str], tmp_path: Path) -> None:
    program = str(Path(sys.executable).with_name("misfit"))
    written = tmp_path / "written.json"
    subprocess.run([program, *command, "--json", str(written), "--quiet"], cwd=ROOT, check=True, capture_output=True)
    section = (
        (site / "reference" / "json_documents.html")
        .read_text()
        .split(f'id="{schema.replace(".", "-").replace("/", "-")}"')[1]
    )
    keys = re.findall(r"<tr>\s*<td><code>(\w+)</code></td>", section.split("<h2")[0])

    assert sorted(keys) == sorted(json.loads(written.read_text()))


def test_keys_of_example_files_are_in_the_reference(site: Path) -> None:
    text = (site / "reference" / "toml_files.html").read_text()
    for file in TOML_FILES:
        section = text.split(f"<code>{file.example}</code>")[0].rpartition("<h2")[2]
        for key in tomllib.loads((ROOT / file.example).read_text()):
            assert f"<code>{key}</code>" in section or "Keys at the top" not in section, f"{file.example}: {key}"


def test_the_start_page_shows_the_numbers_of_the_recorded_run(site: Path) -> None:
    run = json.loads((ROOT / "docs" / "assets" / "falling_error.json").read_text())
    first, last = run["versions"][0]["held_out"]["over_floor"], run["versions"][-1]["held_out"]["over_floor"]
    (picture,) = parts(site / "index.html").pictures
    text = (site / "index.html").read_text()

    assert f"{first:.3g}" in picture["alt"] and f"{last:.3g}" in picture["alt"]
    assert f"from {first:.1f} to {last:.2f} times the noise floor" in " ".join(text.split())
    assert last < 0.1 * first


def luminance(colour: str) -> float:
    """Relative luminance of WCAG 2.1."""
    shares = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    r, g, b = (s / 12.92 if s <= 0.03928 else ((s + 0.055) / 1.055) ** 2.4 for s in shares)
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


def contrast(text: str, ground: str) -> float:
    bright, dark = sorted((luminance(text), luminance(ground)), reverse=True)
    return (bright + 0.05) / (dark + 0.05)


def test_contrast_of_black_on_white_is_21() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)


def test_text_of_the_site_stands_out_of_its_ground() -> None:
    declared = dict(re.findall(r"--md-([\w-]+): (#\w{6});", CSS.read_text()))
    grounds = {SURFACES["paper"], declared["code-bg-color"]}
    on_light = {
        name: value for name, value in declared.items() if re.match(r"(typeset|default|code-(fg|hl)|accent)", name)
    }
    on_dark = {"primary-bg-color": "primary-fg-color", "footer-fg-color": "footer-bg-color"}

    assert {n: v for n, v in on_light.items() for ground in grounds if contrast(v, ground) < 4.5} == {}
    assert all(contrast(declared[text], declared[ground]) >= 4.5 for text, ground in on_dark.items())


def test_links_and_text_have_the_colours_of_all_other_pages() -> None:
    declared = dict(re.findall(r"--md-([\w-]+): (#\w{6});", CSS.read_text()))

    assert declared["typeset-a-color"] == Colour.ACCENT.lower()
    assert declared["default-fg-color"] == Colour.INK.lower()
    assert declared["default-fg-color--light"] == Colour.QUIET.lower()
    assert declared["code-bg-color"] == SURFACES["tint"].lower()


@pytest.fixture
def tab(browser: Any) -> Iterator[Any]:
    """A page of 1280x720 that keeps the addresses outside of the disk that it asked for."""
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.set_default_timeout(90_000)
    page.asked = []
    page.on("request", lambda request: page.asked.append(request.url) if request.url.startswith("http") else None)
    yield page
    page.close()


@pytest.mark.parametrize("name", PAGE_TYPES)
def test_axe_finds_nothing_serious_and_the_network_stays_silent(site: Path, tab: Any, name: str) -> None:
    from axe_playwright_python.sync_playwright import Axe

    tab.goto((site / name).as_uri())
    tab.wait_for_load_state("load")
    found = Axe().run(tab).response["violations"]
    # Playwright makes the folder.
    tab.screenshot(path=ROOT / "build" / "screenshots" / f"site-{name.replace('/', '-').removesuffix('.html')}.png")

    serious = [v for v in found if v["impact"] in ("serious", "critical")]
    assert [(v["id"], [node["html"][:150] for node in v["nodes"]]) for v in serious] == []
    assert tab.asked == []
    assert tab.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


def test_search_works_by_keyboard_on_a_site_opened_from_the_disk(site: Path, tab: Any) -> None:
    tab.goto((site / "index.html").as_uri())
    tab.keyboard.press("/")
    tab.keyboard.type("stribeck")
    tab.wait_for_selector(".md-search-result__item", state="attached", timeout=60_000)

    assert any("stribeck" in text.lower() for text in tab.locator(".md-search-result__item").all_inner_texts())
    assert tab.asked == []


def test_the_first_key_leads_past_the_navigation_to_the_text(site: Path, tab: Any) -> None:
    tab.goto((site / "effects" / "coulomb_friction.html").as_uri())
    tab.keyboard.press("Tab")
    assert "skip" in tab.evaluate("document.activeElement.className")
    tab.keyboard.press("Enter")

    assert tab.evaluate("location.hash") == "#coulomb-friction"


def test_every_law_for_own_models_is_on_its_page(site: Path) -> None:
    text = (site / "reference" / "laws_of_own_models.html").read_text()
    missing = [law.id for law in laws() if f"<code>{law.id}</code>" not in text or law.title not in html.unescape(text)]
    assert not missing
