"""What MkDocs calls while it builds the site: pages and pictures that are made from code, and the order of pages."""

import json
import re
from pathlib import Path
from typing import Any

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page
from mkdocs.utils import get_relative_url

from docs.generator import (
    effect_pages,
    json_pages,
    law_page,
    notebook_page,
    recording_pages,
    studio_pictures,
    toml_pages,
)
from docs.generator.signature_cache import shown_effects

ASSETS = Path(__file__).parents[1] / "assets"
FALLING = "<!-- picture: falling error -->"
# Shown to readers who want nothing to move.
STILL = "added.png"
STUDIO = re.compile(r"<!-- studio: ([\w.]+) -->")
REMOTE_WORKER, LOCAL_WORKER = "https://unpkg.com/iframe-worker/shim", "assets/file_worker.js"
EXTERNAL_LINKS = "external_links.txt"
SEARCH = 'data-md-component="search" role="dialog"'
HOW_TO, EFFECTS, RECORDINGS = "How-to", "Effects", "Real recordings"
SECTION_OF_FOLDER = {"decisions": "Decisions", "benchmarks": "Reference", "tutorials": "Tutorials", "theory": "Theory"}


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Complete the navigation: all effects, and pages that no section names, so that none is lost."""
    sections = {name: content for section in config.nav or [] for name, content in section.items()}
    names = {effect_pages.in_words(effect): f"effects/{effect}.md" for effect in effect_pages.by_id()}
    sections[EFFECTS] += [{name: path} for name, path in sorted(names.items())]
    sections[RECORDINGS] += [
        {words["title"]: f"recordings/{name}.md"} for name, (words, _) in recording_pages.recordings().items()
    ]
    named = json.dumps(config.nav)
    folder = Path(config.docs_dir)
    pages = sorted(str(path.relative_to(folder)) for path in folder.rglob("*.md"))
    for path in pages:
        if f'"{path}"' not in named:
            sections[SECTION_OF_FOLDER.get(path.partition("/")[0], HOW_TO)].append(path)
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the effect catalogue and the file formats."""
    shown = shown_effects()
    pages = {"effects/index.md": effect_pages.index_page()}
    pages |= {f"effects/{e}.md": effect_pages.effect_page(e, cards, shown) for e, cards in effect_pages.by_id().items()}
    pages |= {"reference/toml_files.md": toml_pages.toml_page(), "reference/json_documents.md": json_pages.json_page()}
    pages |= {"reference/laws_of_own_models.md": law_page.law_page()} | recording_pages.pages()
    pages[notebook_page.PAGE] = notebook_page.page()
    for path, text in pages.items():
        files.append(File.generated(config, path, content=text))
    for path, svg in recording_pages.pictures().items():
        files.append(File.generated(config, path, content=svg))
    for name, effect in shown.items():
        files.append(File.generated(config, f"effects/img/{name}.png", content=effect.png.read_bytes()))
    for name, content in studio_pictures.pictures().items():
        files.append(File.generated(config, f"assets/studio/{name}", content=content))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Put the picture of the falling error, and pictures of the studio, where a page asks for them."""
    there = studio_pictures.pictures()

    def shown(found: re.Match[str]) -> str:
        if found[1] not in there:
            return ""
        url = get_relative_url(f"assets/studio/{found[1]}", page.url)
        image = f'<img src="{url}" alt="{studio_pictures.PICTURES[found[1]]}">'
        if not found[1].endswith(".webp"):
            return image
        still = f'<source srcset="{url.replace(found[1], STILL)}" media="(prefers-reduced-motion: reduce)">'
        return f"<picture>{still}{image}</picture>"

    markdown = STUDIO.sub(shown, markdown)
    return markdown.replace(FALLING, _falling_error()) if FALLING in markdown else markdown


def on_page_content(html: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Put what the cells of the notebook show below them."""
    return notebook_page.with_outputs(html) if page.file.src_uri == notebook_page.PAGE else html


def on_post_page(output: str, page: Page, config: MkDocsConfig) -> str:
    """Take a script that the theme would load from the network from here instead, and give its search a name."""
    return output.replace(REMOTE_WORKER, get_relative_url(LOCAL_WORKER, page.url)).replace(
        SEARCH, f'{SEARCH} aria-label="Search"'
    )


def on_post_template(output_content: str, template_name: str, config: MkDocsConfig) -> str:
    """The same for the page that a server shows where there is none."""
    return output_content.replace(REMOTE_WORKER, LOCAL_WORKER)


def on_post_build(config: MkDocsConfig) -> None:
    """List the links that leave the site: nothing follows them while it is built, so somebody has to look at them."""
    site = Path(config.site_dir)
    found = {
        link
        for page in site.rglob("*.html")
        for link in re.findall(r'<a [^>]*href="(https?://[^"]+)', page.read_text())
    }
    (site / EXTERNAL_LINKS).write_text("".join(f"{link}\n" for link in sorted(found)))


def _falling_error() -> str:
    """The picture of a recorded run, with where it comes from."""
    from orchestrator.compare.result import SetErrors
    from orchestrator.report.figures import falling_error

    run: dict[str, Any] = json.loads((ASSETS / "falling_error.json").read_text())
    versions = [
        (version["name"], SetErrors(**version["learning"]), SetErrors(**version["held_out"]))
        for version in run["versions"]
    ]
    first, last = run["versions"][0], run["versions"][-1]
    named = ", ".join(f"{effect['id'].replace('_', ' ')} at {effect['site']}" for effect in last["effects"])
    return (
        f"{falling_error(versions)}\n\nIt names **{named}**. The error of held-out trials, which no parameter was fitted to, falls from"
        f" {first['held_out']['over_floor']:.1f} to {last['held_out']['over_floor']:.2f} times the noise floor. (Recorded by"
        f" `{run['command']}`, misfit {last['misfit_version']} at commit {run['commit']}, {last['date'][:10]}.)"
    )
