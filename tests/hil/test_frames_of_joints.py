"""A recording says whose joints its angles are: a robot's lift joint is no arm's shoulder, though both are called q1."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from fmus.errors import MisfitError
from fmus.symbolic.system import Variable
from hil.barrett.kind import Proficio
from hil.recording.signals import SIGNALS, _case, columns_of
from orchestrator.measurements import load_measurements
from orchestrator.measurements.binding import bind
from orchestrator.results import recorder_for

COLUMNS, FRAME = columns_of(Proficio.joints), Proficio.frame
# Angles of the planar arm that a robot emulates.
ARM = (Variable("q1", "rad"), Variable("q2", "rad"))


@pytest.fixture
def session(tmp_path: Path) -> Path:
    """What a session leaves that broke off in its first trial."""
    times = [0.002 * k for k in range(500)]
    table = {"time": times, **{column.name: [0.1] * len(times) for column in COLUMNS}}
    pq.write_table(pa.table(table), tmp_path / SIGNALS)
    (tmp_path / "case.toml").write_text(_case(times[-1], FRAME, COLUMNS))
    return tmp_path


def test_joints_of_a_robot_are_not_compared_with_an_arms_by_their_names(session: Path) -> None:
    found = load_measurements(session)
    assert found.frame == FRAME
    with pytest.raises(MisfitError, match=r"columns .*q1.* belong to another frame .*robot: Proficio.*\[variables\]"):
        bind(found, (), ARM)


def test_columns_that_are_mapped_may_be_compared(session: Path) -> None:
    case = session / "case.toml"
    kept = [column.name for column in COLUMNS if column.name in ("q2", "q3")]
    table = pq.read_table(session / SIGNALS).select(["time", *kept])
    pq.write_table(table, session / SIGNALS)
    units = '[columns]\ntime = "s"\nq2 = "rad"\nq3 = "rad"\n'
    head = case.read_text().split("[columns]")[0]
    case.write_text(head + units + '[variables]\nq2 = "q1"\nq3 = "q2"\n')
    assert bind(load_measurements(session), (), ARM).output_names == ("q1", "q2")


def test_a_file_of_a_session_says_so_itself_where_its_case_file_is_gone(session: Path) -> None:
    path = session / SIGNALS
    recorder = recorder_for(path)
    recorder.begin(COLUMNS, {"frame": FRAME})
    recorder.rows(np.array([0.0, 0.1, 0.2]), np.zeros((3, len(COLUMNS))))
    recorder.finish()
    (session / "case.toml").unlink()
    for named in (session, path):
        with pytest.raises(MisfitError, match=r"columns .*q1.* belong to another frame .*robot: Proficio"):
            bind(load_measurements(named), (), ARM)
