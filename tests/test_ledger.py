"""The ledger keeps every version, whatever happens to its writers."""

import json
import multiprocessing
import tempfile
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fmus.catalogue import find_modelica_model
from fmus.errors import MisfitError
from orchestrator.compare.comparison import compare
from orchestrator.compare.result import Comparison, SetErrors
from orchestrator.discover import record
from orchestrator.ledger import FILE_NAME, LedgerEntry, append, newest, read
from orchestrator.measurements import load_measurements
from orchestrator.models.symbolic import SymbolicModel
from orchestrator.report.sentences import ledger_sentence
from orchestrator.verdicts.result import Estimate, NamedEffect

PENDULUM = Path(__file__).parent / "cases" / "pendulum"
FRICTION = NamedEffect("coulomb_friction", "joint1", {"tauC[1]": Estimate(0.0373, "N.m", (0.0361, 0.0385))})
ENTRY = LedgerEntry(
    version=1,
    name="Arm_1",
    model="build/Arm_1.mo:Arm_1",
    effects=(FRICTION,),
    learning=SetErrors({"q1": 0.0021, "q2": 0.0019}, 2.0),
    held_out=SetErrors({"q1": 0.0022, "q2": 0.0018}, 2.1),
    noise_floor={"q1": 0.001, "q2": 0.001},
    units={"q1": "rad", "q2": "rad"},
    model_hash="ab" * 32,
    data_hash="cd" * 32,
    date="2025-01-02T03:04:05Z",
    misfit_version="0.1.0",
)

numbers = st.floats(allow_nan=False)
errors = st.builds(SetErrors, st.dictionaries(st.text(), numbers), numbers)
effects = st.builds(
    NamedEffect,
    st.text(),
    st.text(),
    st.dictionaries(st.text(), st.builds(Estimate, numbers, st.text(), st.tuples(numbers, numbers))),
)
entries = st.builds(
    LedgerEntry,
    version=st.integers(0, 10**6),
    effects=st.lists(effects, max_size=2).map(tuple),
    learning=errors,
    held_out=st.none() | errors,
    noise_floor=st.dictionaries(st.text(), numbers),
    units=st.dictionaries(st.text(), st.text()),
)


@settings(max_examples=60, deadline=None)
@given(st.lists(entries, min_size=1, max_size=3, unique_by=lambda e: (e.version, e.model_hash, e.data_hash)))
def test_reading_gives_back_what_was_appended(written: list[LedgerEntry]) -> None:
    with tempfile.TemporaryDirectory() as name:
        for entry in written:
            append(Path(name), entry)

        assert read(Path(name)) == written


def test_every_line_is_strict_json_with_a_schema(tmp_path: Path) -> None:
    append(tmp_path, replace(ENTRY, learning=SetErrors({"q1": float("inf")}, float("nan"))))

    def refuse(name: str) -> float:
        raise AssertionError(f"{name} is not JSON")

    document = json.loads((tmp_path / FILE_NAME).read_text(), parse_constant=refuse)
    assert document["schema"] == "misfit.ledger/1"


def test_a_line_torn_at_any_byte_is_ignored_and_does_not_harm_the_next(tmp_path: Path) -> None:
    first, torn, third = (replace(ENTRY, version=version) for version in (0, 1, 2))
    append(tmp_path, first)
    path = tmp_path / FILE_NAME
    start = path.stat().st_size
    append(tmp_path, torn)
    content = path.read_bytes()

    for length in range(start, len(content)):
        path.write_bytes(content[:length])
        assert read(tmp_path) == [first]
        append(tmp_path, third)
        assert read(tmp_path) == [first, third]


def _append_many(folder: Path, name: str, count: int) -> None:
    for version in range(count):
        append(folder, replace(ENTRY, name=name, version=version, model_hash=name))


def test_two_processes_that_append_at_once_lose_nothing(tmp_path: Path) -> None:
    context = multiprocessing.get_context("spawn")
    writers = [context.Process(target=_append_many, args=(tmp_path, name, 40)) for name in ("a", "b")]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join(60)

    found = [(entry.name, entry.version) for entry in read(tmp_path)]
    assert sorted(found) == [(name, version) for name in "ab" for version in range(40)]


def test_the_last_line_of_a_version_counts(tmp_path: Path) -> None:
    for entry in (replace(ENTRY, version=0, model_hash="given"), ENTRY, replace(ENTRY, learning=SetErrors({}, 1.1))):
        append(tmp_path, entry)

    assert [(entry.version, entry.learning.over_floor) for entry in read(tmp_path)] == [(0, 2.0), (1, 1.1)]


def test_a_model_that_is_compared_again_keeps_its_number_and_gets_its_new_figures(tmp_path: Path) -> None:
    data = load_measurements(PENDULUM)
    source = find_modelica_model("pendulum")
    model = SymbolicModel("pendulum", source.compile())

    def recorded(comparison: Comparison) -> LedgerEntry:
        return record(tmp_path, "pendulum", source, model, (), comparison, data)

    found = compare(model, data, workers=1)
    first, again = recorded(found), recorded(found)
    changed = recorded(replace(found, noise_floor={"theta": 0.5}))

    assert first == again
    assert changed.version == first.version == 0
    assert [entry.noise_floor for entry in read(tmp_path)] == [{"theta": 0.5}]


def test_versions_along_other_measurements_are_left_out_of_the_error_that_falls() -> None:
    old = replace(ENTRY, version=0, name="Old", data_hash="other", held_out=SetErrors({}, 900.0))
    given = replace(ENTRY, version=1, name="Given", effects=(), held_out=SetErrors({"q1": 0.1, "q2": 0.1}, 50.0))
    entries = [old, given, replace(ENTRY, version=2)]

    assert newest(entries) == entries[1:]
    assert ledger_sentence(entries).startswith("From Given to Arm_1 the error on held-out trials went from 50")


def test_a_folder_without_a_ledger_is_named(tmp_path: Path) -> None:
    with pytest.raises(MisfitError, match=r"has no ledger\.jsonl; give the folder"):
        read(tmp_path / "nothing")


@pytest.mark.parametrize("damage", [b"{", b"[]", b"\xff", b'{"schema": "misfit.ledger/1"}', b"", b"[" * 100_000])
def test_a_damaged_line_in_the_middle_is_named(tmp_path: Path, damage: bytes) -> None:
    append(tmp_path, ENTRY)
    with (tmp_path / FILE_NAME).open("ab") as stream:
        stream.write(damage + b"\n")
    append(tmp_path, ENTRY)

    with pytest.raises(MisfitError, match=r"ledger\.jsonl line 2 is damaged"):
        read(tmp_path)


def test_a_newer_schema_is_told_apart_from_damage(tmp_path: Path) -> None:
    (tmp_path / FILE_NAME).write_text('{"schema": "misfit.ledger/2"}\n')

    with pytest.raises(MisfitError, match=r"line 1 has schema 'misfit\.ledger/2', expected 'misfit\.ledger/1'"):
        read(tmp_path)


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")

    with pytest.raises(MisfitError, match="version 1 could not be recorded"):
        append(tmp_path / "file", ENTRY)
