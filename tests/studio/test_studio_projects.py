"""Projects are on disk and nowhere else."""

from pathlib import Path

import pytest

from fmus.errors import MisfitError
from orchestrator.studio.examples import EXAMPLES, open_example
from orchestrator.studio.workspace import Workspace


def test_another_server_finds_every_project_as_it_was_left(tmp_path: Path) -> None:
    first = Workspace(tmp_path).create("arm")
    first.change(model="arm", wanted=2)

    found = Workspace(tmp_path).project(first.id)

    assert (found.name, found.model, found.wanted) == ("arm", "arm", 2)


@pytest.mark.parametrize("id", ["..", "../projects", "", "abc", "ABCDEFGHJK", "aaaaaaaaaa", "aaaaaaaaa\n", "/etc"])
def test_ids_that_are_none_lead_nowhere(tmp_path: Path, id: str) -> None:
    workspace = Workspace(tmp_path)
    workspace.create("arm")

    with pytest.raises(MisfitError, match="no such project"):
        workspace.project(id)


def test_removed_projects_are_gone_with_their_files(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    project = workspace.create("arm")

    workspace.remove(project)

    assert workspace.projects() == [] and list(workspace.folder.iterdir()) == []


def test_damaged_project_leaves_the_others_in_the_list(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    whole, damaged = workspace.create("whole"), workspace.create("damaged")

    (damaged.folder / "project.json").write_text('{"name": ')

    assert [project.id for project in workspace.projects()] == [whole.id]


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda example: example.id)
def test_every_example_brings_a_copy_of_its_measurements_and_a_built_in_model(tmp_path: Path, example: object) -> None:
    from fmus.catalogue import built_in_models
    from orchestrator.measurements import load_measurements

    project = open_example(Workspace(tmp_path), example.id)  # type: ignore[attr-defined]

    assert project.model in built_in_models()
    assert load_measurements(project.measurements).learning
