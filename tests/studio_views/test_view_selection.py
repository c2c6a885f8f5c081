"""Numbers of a selection, the map, and bars are those that numpy computes from the curves."""

from pathlib import Path

import numpy as np
import pytest
from view_builders import FLOOR, UNITS, comparison, trial

from fmus.errors import MisfitError
from orchestrator.compare.maps import coordinates_of
from orchestrator.compare.result import TrialCurves
from orchestrator.studio.views import coordinates as coordinates_module
from orchestrator.studio.views.against import bars_against, bars_of_frequency, offered
from orchestrator.studio.views.errors import trial_errors
from orchestrator.studio.views.link import SelectionLink
from orchestrator.studio.views.selection import Range, Region, Selection
from orchestrator.studio.views.state_map import map_rows, map_sentence, state_map
from orchestrator.studio.views.store import in_memory, read, write

CURVES = (trial(0, 4000), trial(1, 3000), trial(2, 2000, "held_out"))
COMPARISON = comparison(CURVES, where=True)
DATA = in_memory(COMPARISON)


def residual(curves: TrialCurves, name: str) -> np.ndarray:
    return curves.measured[name] - curves.modelled[name]


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def speed(curves: TrialCurves, name: str) -> np.ndarray:
    found = coordinates_of({name: [curves.measured[name]]}, UNITS, {}, {}, [curves.time])
    return next(c.values[0] for c in found if c.name == f"speed of {name}")


def test_errors_of_a_time_are_those_of_its_samples() -> None:
    link = SelectionLink(DATA)
    link.choose_time(Range(5.0, 12.5))
    found = {errors.signal: errors for errors in link.errors()}
    inside = [residual(c, "q2")[(c.time >= 5.0) & (c.time <= 12.5)] for c in CURVES]

    assert found["q2"].selected.count == sum(map(len, inside))
    assert found["q2"].selected.rms == pytest.approx(rms(np.concatenate(inside)), rel=1e-6)
    assert found["q2"].whole.rms == pytest.approx(rms(np.concatenate([residual(c, "q2") for c in CURVES])), rel=1e-6)
    assert found["q2"].times_floor(found["q2"].whole) == pytest.approx(found["q2"].whole.rms / FLOOR["q2"])


def test_errors_of_a_region_within_a_time_are_those_of_its_samples() -> None:
    link = SelectionLink(DATA)
    link.choose_trials((0, 2))
    link.choose_time(Range(3.0, 18.0))
    link.choose_region(Region("q1", Range(0.2, 0.9), "speed of q1", Range(-0.5, 0.1)))
    parts = []
    for c in (CURVES[0], CURVES[2]):
        q, w = c.measured["q1"], speed(c, "q1")
        inside = (q >= 0.2) & (q <= 0.9) & (w >= -0.5) & (w <= 0.1) & (c.time >= 3.0) & (c.time <= 18.0)
        parts.append(residual(c, "q1")[inside])

    selected = link.errors()[0].selected
    assert selected.count == sum(map(len, parts)) > 20
    assert selected.rms == pytest.approx(rms(np.concatenate(parts)), rel=1e-5)
    assert set(trial_errors(DATA, "q1", link.chosen())) == {0, 2}


def test_a_map_counts_and_averages_as_a_histogram_does() -> None:
    found = state_map(SelectionLink(DATA).coordinates, "q1", "q1", "speed of q1", Selection(time=Range(2.0, 9.0)))
    assert found is not None
    edges = [found.along_edges, found.across_edges]
    for boxes, (low, high) in ((found.whole, (0.0, 99.0)), (found.selected, (2.0, 9.0))):
        keep = [(c.time >= low) & (c.time <= high) for c in CURVES]
        x, y, e = (
            np.concatenate([values[k] for values, k in zip(part, keep, strict=True)])
            for part in (
                [c.measured["q1"] for c in CURVES],
                [speed(c, "q1") for c in CURVES],
                [residual(c, "q1") for c in CURVES],
            )
        )
        count = np.histogram2d(y, x, edges)[0]
        total = np.histogram2d(y, x, edges, weights=e)[0]
        # Values at an edge may fall to either side in float32.
        assert np.abs(boxes.count - count).sum() <= 6
        same = (boxes.count == count) & (count > 0)
        np.testing.assert_allclose(boxes.mean[same], total[same] / count[same], rtol=1e-4, atol=1e-5)
        assert boxes.count.sum() == len(x)


def test_the_sentence_of_a_map_names_its_worst_box() -> None:
    curves = TrialCurves(
        "a.csv", "learning", np.arange(400.0),
        {"q1": np.repeat([0.0, 1.0, 2.0, 3.0], 100) / 3 * 24, "q2": np.tile([0.0, 16.0], 200)},
        {"q1": np.repeat([0.0, 1.0, 2.0, 3.0], 100) / 3 * 24 - np.repeat([0.1, 0.1, 0.5, 0.1], 100), "q2": np.zeros(400)}, {},
    )  # fmt: skip
    found = state_map(SelectionLink(in_memory(comparison([curves]))).coordinates, "q1", "q1", "q2", Selection())
    assert found is not None

    sentence = map_sentence(found, ("rad", "rad"), "rad", 0.1)
    assert "largest, 500 mrad rms, 5.00 times the noise floor, where q1 is 16.0 to 17.0 rad" in sentence
    assert "smallest, 100 mrad" in sentence
    assert map_rows(found, ("rad", "rad"), "rad")[0][1:] == ["500 mrad", "500 mrad", "50"]


def test_a_map_over_what_does_not_vary_is_none() -> None:
    curves = trial(0, 500)
    still = TrialCurves("a.csv", "learning", curves.time, {**curves.measured, "q2": np.ones(500)}, curves.modelled, {})

    assert state_map(SelectionLink(in_memory(comparison([still]))).coordinates, "q1", "q2", "q1", Selection()) is None


@pytest.mark.parametrize("against", ["amplitude of q1", "q2", "u1", "time"])
def test_selecting_all_learning_samples_gives_the_errors_of_the_comparison(against: str) -> None:
    link = SelectionLink(DATA)
    link.choose_trials((0, 1))
    found = bars_against(link.coordinates, "q1", against, link.chosen())

    assert against in offered(DATA, "q1")
    assert len(found.bars) >= 4
    assert [bar.selected for bar in found.bars] == pytest.approx([bar.rms for bar in found.bars], rel=2e-3)


def test_the_spectrum_of_all_of_a_trial_is_that_of_its_comparison() -> None:
    one = in_memory(comparison(CURVES[:1], where=True))
    found = bars_of_frequency(one, "q2", SelectionLink(one).chosen())

    assert [bar.selected for bar in found.bars] == pytest.approx([bar.rms for bar in found.bars], rel=1e-5)


def test_the_spectrum_of_a_time_shows_the_tone_that_sounds_then() -> None:
    link = SelectionLink(DATA)
    link.choose_trials((0,))
    for time, expected in ((Range(21.0, 39.0), 0.05 / np.sqrt(2)), (Range(1.0, 19.0), 0.0)):
        link.choose_time(time)
        bars = bars_of_frequency(DATA, "q2", link.chosen()).bars
        tone = np.sqrt(sum((bar.selected or 0.0) ** 2 for bar in bars if bar.low < 4 and bar.high > 1))
        assert tone == pytest.approx(expected, abs=0.006)


def test_a_short_piece_says_nothing_on_slow_bands() -> None:
    link = SelectionLink(DATA)
    link.choose_time(Range(5.0, 5.3))
    bars = bars_of_frequency(DATA, "q1", link.chosen()).bars

    assert bars[0].selected is None and bars[-2].selected is not None


def test_long_records_are_mapped_by_every_second_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(coordinates_module, "MOST_SAMPLES", 5000)
    link = SelectionLink(DATA)
    everything = state_map(link.coordinates, "q1", "q1", "q2", Selection())
    link.choose_region(Region("time", Range(-1.0, 99.0), "q1", Range(-9.0, 9.0)))

    assert link.coordinates.stride == 2
    assert everything is not None and everything.whole.count.sum() == 4500
    # What is told of a region is of all samples that it stands for.
    assert link.errors()[0].selected.count == 9000


def test_listeners_hear_each_change_once() -> None:
    link, heard = SelectionLink(DATA), []
    link.listen(heard.append)
    link.choose_time(Range(1.0, 2.0))
    link.choose_time(Range(1.0, 2.0))
    link.choose_signal("q2")
    link.clear()

    assert heard == [Selection(time=Range(1.0, 2.0))] * 2 + [Selection()]


def test_a_new_version_shows_what_was_selected_in_the_one_before() -> None:
    before = SelectionLink(DATA)
    before.choose_signal("q2")
    before.choose_time(Range(1.0, 2.0))
    other = in_memory(comparison([trial(0, 100)]))

    after = SelectionLink(in_memory(COMPARISON), before)
    assert (after.signal, after.selection) == ("q2", before.selection)
    assert SelectionLink(other, before).selection == Selection()


@pytest.mark.parametrize(
    ("ends", "words"),
    [((3.0, 1.0), "time from 3 to 1 s is empty"), ((None, 2.0), "time from nothing to 2 s: an end is missing")],
)
def test_a_typed_range_that_cannot_be_is_refused_in_words(ends: tuple[float | None, float], words: str) -> None:
    with pytest.raises(MisfitError, match=words):
        Range.entered(*ends, "time", "s")


def test_a_comparison_read_from_disk_is_the_one_that_was_written(tmp_path: Path) -> None:
    write(tmp_path / "views", COMPARISON)
    found = SelectionLink(read(tmp_path / "views"))
    found.choose_time(Range(5.0, 12.5))
    expected = SelectionLink(DATA)
    expected.choose_time(Range(5.0, 12.5))

    assert isinstance(found.data.trials[0].signals["q1"].measured.series, np.memmap)
    assert found.errors() == expected.errors()
    assert [t.name for t in found.data.trials] == [c.file for c in CURVES]
    assert list(tmp_path.iterdir()) == [tmp_path / "views"]


def test_a_page_keeps_little_of_a_long_record_in_memory(tmp_path: Path) -> None:
    write(tmp_path / "views", comparison([trial(0, 100_000)]))
    [found] = read(tmp_path / "views").trials
    kept = [level for signal in found.signals.values() for level in signal.residual.levels[1:]]

    # Series, times, smallest blocks and their sums stay in files that the system may take out of memory.
    mapped = [
        found.time,
        *(array for s in found.signals.values() for array in (s.residual.series, s.residual.levels[0], s.sums.blocks)),
    ]
    assert all(_is_mapped(array) for array in mapped)
    assert sum(level.nbytes for level in kept) < 2 * 100_000 * 4 / 15


def _is_mapped(array: np.ndarray) -> bool:
    base: object = array
    while isinstance(base, np.ndarray) and not isinstance(base, np.memmap):
        base = base.base
    return isinstance(base, np.memmap)


def test_curves_are_never_written_over_others(tmp_path: Path) -> None:
    write(tmp_path / "views", COMPARISON)
    with pytest.raises(MisfitError, match="curves cannot be written"):
        write(tmp_path / "views", COMPARISON)
    assert list(tmp_path.iterdir()) == [tmp_path / "views"]


def test_damaged_curves_are_told_in_a_line(tmp_path: Path) -> None:
    write(tmp_path / "views", COMPARISON)
    (tmp_path / "views" / "1.residual.0.npy").write_bytes(b"")
    with pytest.raises(MisfitError, match="compare again"):
        read(tmp_path / "views")
