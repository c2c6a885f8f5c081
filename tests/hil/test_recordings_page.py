"""From a recording to a project of the studio by a click: its measurement set and a model are there, and it is diagnosed as any other."""

from pathlib import Path

import pytest
from nicegui import Client, ui
from nicegui.page import page as nicegui_page
from starlette.requests import Request

from fmus.errors import MisfitError
from hil.bench_view import recordings_page
from hil.bench_view.recordings_page import Recording, make_project, recordings
from hil.bench_view.watched import Sessions
from orchestrator.measurements import load_measurements
from orchestrator.studio import workspace
from tests.hil.test_identify import record


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("recordings") / "turned", 2.0)


def test_a_recording_becomes_a_project_with_a_set_and_a_nominal_model(session: Path, tmp_path: Path) -> None:
    project = make_project(workspace.Workspace(tmp_path), session)
    assert project.model == "model/Nominal.mo:Nominal" and (project.folder / "model/Nominal.mo").exists()
    assert [file.name for file in project.data_files()] == ["case.toml", "joint.parquet"]
    assert {trial.subset for trial in load_measurements(project.measurements).trials} == {"learning", "held_out"}


def test_trials_of_the_emulated_arm_become_a_project_with_the_arms_model(session: Path, tmp_path: Path) -> None:
    trials = tmp_path / "trials"
    trials.mkdir()
    set_of_one = make_project(workspace.Workspace(tmp_path / "one"), session).measurements
    (trials / "trial_01.parquet").write_bytes((set_of_one / "joint.parquet").read_bytes())
    case = (set_of_one / "case.toml").read_text().replace("joint.parquet", "trial_01.parquet")
    (trials / "case.toml").write_text(f'frame = "arm"\n{case}')
    project = make_project(workspace.Workspace(tmp_path), trials)
    assert project.model == "arm"
    assert [file.name for file in project.data_files()] == ["case.toml", "trial_01.parquet"]


def test_a_recording_that_says_nothing_leaves_no_project(tmp_path: Path) -> None:
    still = record(tmp_path / "still", 0.3, arm=False)
    home = workspace.Workspace(tmp_path)
    with pytest.raises(MisfitError, match="cycles of an armed arm"):
        make_project(home, still)
    assert home.projects() == []


def test_recordings_are_found_in_a_folder_and_below_it_and_others_are_left_out(session: Path, tmp_path: Path) -> None:
    (tmp_path / "frames.bin").write_bytes(b"")
    assert recordings(session.parent, session, tmp_path) == [Recording(session.resolve())]
    assert "not finished: misfit hil finish" in Recording(session).words


def test_a_click_on_the_page_makes_the_project_and_opens_it(
    session: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home, opened = workspace.use(tmp_path), []
    monkeypatch.setattr(recordings_page, "SESSIONS", Sessions())
    monkeypatch.setattr(recordings_page, "USUAL", session.parent)
    monkeypatch.setattr("nicegui.ui.navigate.to", opened.append)

    async def at_once(do, *given):  # type: ignore[no-untyped-def]
        return do(*given)

    monkeypatch.setattr("nicegui.run.io_bound", at_once)
    scope = {"type": "http", "method": "GET", "path": "/recordings", "query_string": b"", "scheme": "http"}
    request = Request(scope | {"headers": [(b"host", b"127.0.0.1:80")], "server": ("127.0.0.1", 80)})
    with Client(nicegui_page("/recordings"), request=request) as client:
        recordings_page.build()
        labels = [each.props.get("aria-label") for each in client.elements.values() if isinstance(each, ui.button)]
        assert labels == ["Make a project of turned"]
        made = recordings_page._maker(Recording(session), ui.select({0: "most", 3: "joint 3"}, value=3))()
        with pytest.raises(StopIteration):  # it waits for nothing here
            made.__await__().send(None)
    client.delete()
    [project] = home.projects()
    assert opened == [f"/project/{project.id}"]
