"""Pictures of the studio's pages: a browser does what a reader would do, and keeps what it sees.

`python -m docs.generator.studio_pictures FOLDER` takes them; the build of the site does so once for each content of the studio.
"""

import hashlib
import io
import logging
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from fmus.files import cache_folder
from tests.chromium import FLAGS, program
from tests.studio.studio_process import ROOT, Studio, sign_in, start

if TYPE_CHECKING:
    from playwright.sync_api import Page

# What each picture shows, for those who cannot see it.
PICTURES = {
    "main_job.webp": "Four screens of the studio, one after the other: the data of a pendulum, the answer that friction is missing, the error"
    " that has fallen, and the projects.",
    "start.png": "The studio's first page: three examples, and a project with its model, its answer and a small curve of its falling error.",
    "import.png": "A table of the columns of a file with menus for model variable, unit and what happens between samples.",
    "answer.png": "The answer: viscous friction is missing, its size, what it buys, where the model failed, and what else it could be.",
    "added.png": "The answer after a click on Add: the error on held-out trials fell.",
    "evidence.png": "Behind the answer: curves of measurement and model over their residual, and the residual over the state.",
    "swap.png": "Two muscles side by side: their outputs part, and when; how fast each runs; how their interfaces differ.",
    "bench.png": "A session with a virtual robot: its state, joints with their limits, the trial, and a drawing of the arm.",
    "recordings.png": "A recorded session with a button that makes a project of it.",
    "regression.png": "The report of a failed regression test: both curves, the tolerance around the reference, and where it is left.",
}
SOURCES = (
    Path(__file__),
    ROOT / "orchestrator" / "studio",
    ROOT / "orchestrator" / "report",
    ROOT / "hil" / "bench_view",
)
SIZE = {"width": 1280, "height": 800}
# Of a busy machine, too: a diagnosis takes 20 s of a processor of its own.
PATIENCE_MS = 600_000
SECONDS_A_FRAME = 2.5
GERMAN = "Zeit [s];Drehmoment [mNm];Drehwinkel [°]\n"
WEAK = 'model WeakMuscle "The muscle of the library with 80 % of its force"\n  extends FESArm.Muscles.MuscleAlone(law(Fmax=0.8*Fmax));\nend WeakMuscle;\n'
TRIAL = """rest = [0.75, 1.35]
settle_s = 0.3
announce_s = 0.3
stimulate_s = 6.0
rise_s = 0.3
confirm = false
[[trials]]
posture = [0.72, 1.32]
activations = [0.1, 0, 0.2, 0, 0, 0.1]
"""


@cache
def pictures() -> dict[str, bytes]:
    """Each picture by its name; none where no browser is, or `MISFIT_PICTURES` is `no`."""
    if not wanted() or program() is None:
        logging.getLogger("mkdocs").info(
            "the site is built without pictures of the studio: no Chromium is on this machine"
        )
        return {}
    folder = cache_folder("studio-pictures") / content_of(SOURCES)
    if not all((folder / name).is_file() for name in PICTURES):
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as taken:
            take(Path(taken))
            for name in PICTURES:
                (Path(taken) / name).replace(folder / name)
    return {name: (folder / name).read_bytes() for name in PICTURES}


def wanted() -> bool:
    """Whether the build takes pictures and runs the notebook, which lasts longer than all the rest."""
    return os.environ.get("MISFIT_PICTURES") != "no"


def content_of(sources: Iterable[Path]) -> str:
    """A hash of files and of the code in folders."""
    files = [file for source in sources for file in (sorted(source.rglob("*")) if source.is_dir() else [source])]
    found = hashlib.sha256()
    for file in files:
        if file.suffix in (".py", ".css", ".js", ".j2", ".ipynb"):
            found.update(file.read_bytes())
    return found.hexdigest()[:16]


def take(folder: Path) -> None:
    """Write every picture into a folder that exists."""
    with _browser() as (tab, studio):
        keep = _Keeper(tab, folder)
        _main_job(tab, studio, keep)
        _import(tab, studio, keep)
        _swap(tab, studio, keep)
        _bench(tab, studio, keep)
        _regression(tab, keep)


class _Keeper:
    """Takes pictures of a tab."""

    def __init__(self, tab: "Page", folder: Path) -> None:
        self.tab, self.folder = tab, folder

    def __call__(self, name: str) -> bytes:
        self.tab.wait_for_timeout(600)  # what comes late, such as plots
        return self.tab.screenshot(path=self.folder / f"{name}.png")


def _main_job(tab: "Page", studio: Studio, keep: _Keeper) -> None:
    tab.goto(studio.url)
    tab.get_by_role("button", name="Open: A real pendulum").click()
    tab.get_by_role("button", name="Diagnose", disabled=False).wait_for()
    tab.get_by_text("columns are variables of the model").wait_for()
    frames = [keep("data")]
    tab.get_by_role("button", name="Diagnose").click()
    tab.locator(".a-verdict h2").wait_for()
    tab.get_by_role("button", name="Add it to the model", disabled=False).wait_for()
    frames.append(keep("answer"))
    tab.get_by_role("button", name="Add it to the model").click()
    tab.get_by_text("has it: the error on held-out trials fell").wait_for()
    tab.get_by_role("button", name="Undo", disabled=False).wait_for()
    frames.append(keep("added"))
    tab.get_by_role("button", name="Why do you think so?").click()
    tab.locator(".view-curves canvas").first.wait_for()
    tab.get_by_role("heading", name="Curves").scroll_into_view_if_needed()
    tab.evaluate("document.querySelector('.view-curves').scrollIntoView()")
    keep("evidence")
    tab.goto(studio.url)
    tab.get_by_role("link", name="A real pendulum").wait_for()
    frames.append(keep("start"))
    _animated(frames, keep.folder / "main_job.webp")


def _animated(frames: list[bytes], target: Path) -> None:
    from PIL import Image

    images = [Image.open(io.BytesIO(frame)).convert("RGB").resize((960, 600)) for frame in frames]
    images[0].save(
        target, save_all=True, append_images=images[1:], duration=int(1000 * SECONDS_A_FRAME), loop=3, quality=80
    )


def _import(tab: "Page", studio: Studio, keep: _Keeper) -> None:
    rows = [(k / 100, 40.0, 0.5 * 2.0 * (k / 100) ** 2 * 57.29578) for k in range(300)]
    text = GERMAN + "".join(";".join(f"{value:.4f}" for value in row).replace(".", ",") + "\n" for row in rows)
    file = keep.folder / "Prüfstand.csv"
    file.write_text(text)
    tab.get_by_role("button", name="New project").click()
    tab.wait_for_url("**/project/*")
    tab.locator("select").first.select_option("drive")
    tab.get_by_text("Model: drive").wait_for()
    tab.locator("#choose-measurements").set_input_files(file)
    tab.get_by_text("columns are variables of the model").wait_for()
    keep("import")
    file.unlink()


def _swap(tab: "Page", studio: Studio, keep: _Keeper) -> None:
    weak = keep.folder / "WeakMuscle.mo"
    weak.write_text(WEAK)
    _misfit("build", "arm-muscle", "--out", str(keep.folder))
    _misfit("build", f"{weak}:WeakMuscle", "--out", str(keep.folder))
    tab.goto(f"{studio.url}/swap")
    for side, name in (("old", "arm-muscle"), ("new", "WeakMuscle")):
        tab.locator(f"#choose-{side}").set_input_files(keep.folder / f"{name}.fmu")
        tab.get_by_text(f"{name}.fmu was taken.").wait_for()
    tab.get_by_text("They do not do the same").wait_for()
    tab.get_by_text("They do not do the same").scroll_into_view_if_needed()
    tab.evaluate("window.scrollBy(0, 500)")
    keep("swap")


def _bench(tab: "Page", studio: Studio, keep: _Keeper) -> None:
    trial = keep.folder / "one_trial.toml"
    trial.write_text(TRIAL)
    session = subprocess.Popen(
        [*_MISFIT, "hil", "record", str(trial), "--virtual", "--rate", "100", "--out", str(keep.folder / "session")],
        stdout=subprocess.DEVNULL,
    )
    tab.goto(f"{studio.url}/bench")
    tab.locator("svg.arm").first.wait_for()
    tab.wait_for_timeout(4000)  # until it moves
    keep("bench")
    session.wait(timeout=60)
    tab.goto(f"{studio.url}/recordings")
    tab.get_by_role("button", name="Make a project").first.wait_for()
    keep("recordings")


def _regression(tab: "Page", keep: _Keeper) -> None:
    report = keep.folder / "changed.html"
    case = keep.folder / "drive.regress.toml"
    text = 'model = "drive"\n{}[run]\nstop = 2.0\nstep = 0.005\n[inputs]\ntorque = {{ kind = "sine", amplitude = 0.1, frequency = 0.5 }}\n[tolerance]\nrelative = 1e-3\n'
    case.write_text(text.format(""))
    _misfit("regress", str(case), "--update")
    case.write_text(text.format("[parameters]\nJ = 0.022\n"))
    _misfit("regress", str(case), "--html", str(report), expected=1)
    tab.goto(report.as_uri())
    keep("regression")


_MISFIT = (sys.executable, "-m", "orchestrator.cli")


def _misfit(*arguments: str, expected: int = 0) -> None:
    done = subprocess.run([*_MISFIT, *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != expected:
        raise RuntimeError(f"misfit {' '.join(arguments)} ended with {done.returncode}: {done.stderr}")


@contextmanager
def _browser() -> Iterator[tuple["Page", Studio]]:
    """A signed-in tab of a studio that knows nothing yet, and that sees the sessions of this process only."""
    from playwright.sync_api import sync_playwright

    shared = "/dev/shm" if Path("/dev/shm").is_dir() else None
    with (
        tempfile.TemporaryDirectory() as home,
        tempfile.TemporaryDirectory(prefix="misfit-pictures-", dir=shared) as own,
        sync_playwright() as playwright,
    ):
        os.environ["MISFIT_SHARED"] = own
        studio = start(Path(home) / "workspace")
        browser = playwright.chromium.launch(executable_path=program(), args=FLAGS)
        try:
            window = browser.new_context(viewport=SIZE)  # type: ignore[arg-type]
            window.set_default_timeout(PATIENCE_MS)
            window.add_cookies([sign_in(studio)])  # type: ignore[list-item]
            yield window.new_page(), studio
        finally:
            browser.close()
            studio.stop()


if __name__ == "__main__":
    Path(sys.argv[1]).mkdir(parents=True, exist_ok=True)
    take(Path(sys.argv[1]))
