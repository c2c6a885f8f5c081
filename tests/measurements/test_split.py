"""Which data are held out."""

from collections.abc import Callable
from pathlib import Path

import pytest

from fmus.errors import MisfitError
from orchestrator.measurements import load_measurements

WriteCase = Callable[..., Path]


def subsets(path: Path) -> list[tuple[str, str]]:
    return [(t.name, t.subset) for t in load_measurements(path).trials]


@pytest.mark.parametrize(("n_trials", "n_held_out"), [(2, 1), (3, 1), (4, 2), (6, 2), (7, 3)])
def test_without_a_split_the_last_third_of_the_trials_rounded_up_is_held_out(
    write_case: WriteCase, swing: str, n_trials: int, n_held_out: int
) -> None:
    names = [f"trial_{i}.csv" for i in range(n_trials)]
    folder = write_case(dict.fromkeys(names, swing))

    measurements = load_measurements(folder)

    n_learning = n_trials - n_held_out
    assert [t.name for t in measurements.learning] == names[:n_learning]
    assert [t.name for t in measurements.held_out] == names[n_learning:]
    assert any("last third of the trials" in note for note in measurements.notes)


def test_without_a_split_the_last_third_of_a_single_record_is_held_out(write_case: WriteCase) -> None:
    rows = "".join(f"{k},{k}\n" for k in range(10))
    folder = write_case({"a.csv": "time,q\n" + rows})

    measurements = load_measurements(folder)

    learning, held_out = measurements.trials
    assert (learning.name, held_out.name) == ("a.csv [0, 6] s", "a.csv [6, 9] s")
    assert learning.time.tolist() == [0, 1, 2, 3, 4, 5]
    assert held_out.columns["q"].tolist() == [6, 7, 8, 9]
    assert any("last third of the record" in note for note in measurements.notes)


def test_a_record_of_three_samples_is_not_cut(write_case: WriteCase) -> None:
    measurements = load_measurements(write_case({"a.csv": "t,q\n0,1\n1,1\n2,1\n"}))
    assert len(measurements.learning[0].time) == 3
    assert measurements.held_out == ()
    assert any("too few samples" in note for note in measurements.notes)


def test_windows_cut_one_record_without_sharing_the_sample_between_them(write_case: WriteCase, swing: str) -> None:
    case = "learning_window_s = [0.0, 0.5]\nheld_out_window_s = [0.5, 0.8]\n"
    learning, held_out = load_measurements(write_case({"a.csv": swing}, case)).trials
    assert (learning.name, learning.subset) == ("a.csv [0, 0.5] s", "learning")
    assert (held_out.name, held_out.subset) == ("a.csv [0.5, 0.8] s", "held_out")
    assert learning.time.tolist() == [0.0, 0.1, 0.2, 0.3, 0.4]
    assert held_out.time.tolist() == [0.5, 0.6, 0.7]


@pytest.mark.parametrize(
    ("case", "expected"),
    [
        ("learning = [1]", ["learning", "held_out", "held_out"]),
        ("held_out = [1]", ["held_out", "learning", "learning"]),
        ("learning = [3, 1]\nheld_out = [2]", ["learning", "held_out", "learning"]),
    ],
)
def test_trials_that_one_list_leaves_out_go_to_the_absent_list(
    write_case: WriteCase, swing: str, case: str, expected: list[str]
) -> None:
    names = ["a.csv", "b.csv", "c.csv"]
    folder = write_case(dict.fromkeys(names, swing), case)
    assert subsets(folder) == list(zip(names, expected, strict=True))


def test_a_trial_in_neither_list_is_left_out_and_named(write_case: WriteCase, swing: str) -> None:
    case = "learning = [1]\nheld_out = [3]\n"
    folder = write_case({"a.csv": swing, "b.csv": swing, "c.csv": swing}, case)
    assert subsets(folder) == [("a.csv", "learning"), ("c.csv", "held_out")]
    assert any("b.csv is neither" in n for n in load_measurements(folder).notes)


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ("learning = [1, 2]\nheld_out = [2]", "trial 2 is in learning and in held_out"),
        ("learning = [1, 3]", "learning names trial 3, but there are 2 files"),
        ("held_out = [0]", "held_out names trial 0, but there are 2 files"),
        ("held_out = [1, 2]", "no trial is left for learning"),
        ('learning = ["d.csv"]', "expected a list of trial numbers"),
        ("learning = 1", "'learning' = 1, expected a list of trial numbers"),
        (
            "learning_window_s = [0, 1]\nheld_out_window_s = [1, 2]",
            "windows cut one long record, but there are 2 files",
        ),
    ],
)
def test_a_split_that_does_not_fit_the_files_is_refused(
    write_case: WriteCase, swing: str, case: str, words: str
) -> None:
    folder = write_case({"a.csv": swing, "b.csv": swing}, case)
    with pytest.raises(MisfitError) as caught:
        load_measurements(folder)
    assert "case.toml" in str(caught.value)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("case", "words"),
    [
        (
            "learning_window_s = [0.0, 0.6]\nheld_out_window_s = [0.5, 0.9]",
            "learning_window_s = [0.0, 0.6] s and held_out_window_s = [0.5, 0.9] s overlap",
        ),
        (
            "learning_window_s = [0.0, 0.6]\nheld_out_window_s = [5, 9]",
            "held_out_window_s = [5, 9] s holds 0 samples of a record from 0 s to 0.9 s",
        ),
        ("learning_window_s = [0.0, 0.6]", "belong together"),
        (
            "learning_window_s = [0.6, 0.0]\nheld_out_window_s = [5, 9]",
            "'learning_window_s' = [0.6, 0.0], expected two numbers [start, stop] in s",
        ),
        ("learning = [1]\nlearning_window_s = [0.0, 0.6]", "both trial numbers (learning, held_out) and windows"),
    ],
)
def test_windows_that_do_not_fit_the_record_are_refused(
    write_case: WriteCase, swing: str, case: str, words: str
) -> None:
    with pytest.raises(MisfitError) as caught:
        load_measurements(write_case({"a.csv": swing}, case))
    assert words in str(caught.value)


def test_trials_may_be_chosen_by_the_names_of_their_files(write_case: WriteCase, swing: str) -> None:
    case = 'files = ["a.csv", "b.csv", "c.csv"]\nlearning = ["c.csv", 1]\nheld_out = ["b.csv"]\n'
    folder = write_case(dict.fromkeys(("a.csv", "b.csv", "c.csv"), swing), case)
    assert subsets(folder) == [("a.csv", "learning"), ("b.csv", "held_out"), ("c.csv", "learning")]


def test_a_trial_that_no_file_has_is_refused_with_what_could_be_written(write_case: WriteCase, swing: str) -> None:
    folder = write_case({"a.csv": swing}, 'learning = ["d.csv"]\n')
    with pytest.raises(
        MisfitError, match=r"'learning' = \['d.csv'\], expected a list of trial numbers, such as \[1, 2\], or of"
    ):
        load_measurements(folder)
