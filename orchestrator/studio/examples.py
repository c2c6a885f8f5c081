"""Shipped measurements, so that an empty studio is of use at once."""

import shutil
from dataclasses import dataclass
from pathlib import Path

from orchestrator.studio.project import Project
from orchestrator.studio.workspace import Workspace


@dataclass(frozen=True)
class Example:
    """A model and measurements that it does not explain; `source` is the place of the data in a checkout."""

    id: str
    title: str
    text: str
    model: str
    source: str


EXAMPLES = (
    Example(
        "arm",
        "An arm with a hidden effect",
        "Two joints, six muscles, six trials of 10 s, made by an independent simulator. A few minutes.",
        "arm",
        "tests/cases/arm/case_009",
    ),
    Example(
        "rat_muscle",
        "A real rat muscle",
        "Twelve contractions of a gastrocnemius, recorded in situ, against its published parameters. A few minutes.",
        "rat-muscle",
        "tests/cases/rat_muscle",
    ),
    Example(
        "pendulum",
        "A real pendulum",
        "The free swing of a pendulum, 30 s at 1 kHz, against a pendulum without friction.",
        "pendulum",
        "tests/cases/pendulum",
    ),
)


def open_example(workspace: Workspace, id: str) -> Project:
    """A new project with a copy of an example."""
    example = next(each for each in EXAMPLES if each.id == id)
    project = workspace.create(example.title)
    shutil.copytree(_folder(example), project.measurements, dirs_exist_ok=True)
    project.change(model=example.model)
    return project


def _folder(example: Example) -> Path:
    """Inside the package in an installed wheel (pyproject.toml puts it there), in the tests of a checkout."""
    here = Path(__file__).resolve().parent
    installed = here / "examples" / example.id
    return installed if installed.is_dir() else here.parents[1] / example.source
