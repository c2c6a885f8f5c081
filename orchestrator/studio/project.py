"""One project: a folder with a model, measurements and results."""

import json
import shutil
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from fmus.errors import MisfitError
from fmus.files import write_atomically

FILE_NAME = "project.json"
MATCH, COMPARISON, DIAGNOSIS = "match.json", "comparison.json", "diagnosis.json"
REPORT, COMPARISON_REPORT, REPLAY = "report.html", "comparison.html", "replay.json"
# One for each step of the diagnosis that was added, and the curves of each, for the linked views.
VERSION, VIEWS = "version-{}.json", "views-{}"


def file_stamp(path: Path) -> Hashable:
    """Changes whenever a file is written, made or removed."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size, found.st_ino


@lru_cache(maxsize=64)
def _read(path: Path, stamp: Hashable) -> dict[str, Any] | None:
    """Pages look twice a second, and a diagnosis may be long: parse a file only when it has changed."""
    try:
        return dict(json.loads(path.read_text()))
    except (OSError, ValueError):
        return None


@dataclass(frozen=True)
class Project:
    """A folder on disk; whoever holds the same folder sees the same project.

    `measurements/` and `model/` hold what the user gave, `results/` what was found, `job/` the present or last job.
    """

    folder: Path

    @property
    def id(self) -> str:
        """The part of the address that names the project."""
        return self.folder.name

    @property
    def exists(self) -> bool:
        """Whether it was created and not removed, and can be read."""
        try:
            return "name" in self.settings
        except MisfitError:
            return False

    @property
    def name(self) -> str:
        """What the user calls it."""
        return str(self.settings["name"])

    @property
    def created(self) -> str:
        """When, ISO 8601 in UTC."""
        return str(self.settings["created"])

    @property
    def model(self) -> str | None:
        """MODEL as on a command line that is run in the project's folder; None while none is chosen."""
        return self.settings.get("model")

    @property
    def wanted(self) -> int:
        """How many steps of the diagnosis the user wants in the model: 0 is the model as given."""
        return int(self.settings.get("wanted", 0))

    @property
    def settings(self) -> dict[str, Any]:
        """What stands in `project.json`.

        Raises:
            MisfitError: if the project was removed meanwhile or the file is damaged.
        """
        try:
            document = json.loads((self.folder / FILE_NAME).read_text())
        except (OSError, ValueError) as error:
            raise MisfitError(
                f"project {self.id} cannot be read ({error}); choose another on the start page"
            ) from error
        return dict(document)

    def change(self, **values: Any) -> None:
        """Set values in `project.json`, as a whole or not at all."""
        known = self.settings if self.exists else {"schema": "misfit.project/1"}
        write_atomically(self.folder / FILE_NAME, (json.dumps(known | values, indent=2) + "\n").encode())

    @property
    def measurements(self) -> Path:
        """Folder of the recorded trials."""
        return self._folder("measurements")

    @property
    def results(self) -> Path:
        """Folder of what was found."""
        return self._folder("results")

    def data_files(self) -> list[Path]:
        """The files that the user gave as measurements, by name."""
        return sorted(file for file in self.measurements.rglob("*") if file.is_file() and file.name[0] != ".")

    def choose_model(self, model: str, classes: Sequence[str] = ()) -> None:
        """Work on another model, of a Modelica file with these classes; results of the former one are dropped."""
        self.forget_results()
        self.change(model=model, wanted=0, **({"classes": list(classes)} if classes else {}))

    def wish(self, column: str, key: str, value: str) -> None:
        """Say what a column is (`key`: variables, units or interpolation); results are dropped."""
        wishes = self.wishes
        self.forget_results()
        self.change(wishes={**wishes, key: {**wishes.get(key, {}), column: value}})

    @property
    def wishes(self) -> dict[str, dict[str, str]]:
        """What the user said of columns, by key."""
        return dict(self.settings.get("wishes", {}))

    def forget_results(self) -> None:
        """Drop results, which belong to a model and measurements that are about to change."""
        for name in ("results", "job"):
            shutil.rmtree(self.folder / name, ignore_errors=True)
        self.change(wanted=0, wishes={})

    def result(self, name: str) -> dict[str, Any] | None:
        """A JSON result, which the caller leaves as it is; None while there is none."""
        path = self.folder / "results" / name
        return _read(path, file_stamp(path))

    def _folder(self, name: str) -> Path:
        folder = self.folder / name
        folder.mkdir(parents=True, exist_ok=True)
        return folder
