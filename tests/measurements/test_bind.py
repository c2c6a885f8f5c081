"""From columns to the inputs and outputs of a model."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from fmus.errors import MisfitError
from fmus.symbolic.system import Variable
from orchestrator.measurements import BoundSet, bind, load_measurements

WriteCase = Callable[..., Path]

ANGLE = Variable("q", "rad")
DATA = "time,u,q,extra\n0,1,10,5\n0.1,2,20,5\n0.2,3,30,5\n"


def bound(folder: Path, inputs: list[Variable], outputs: list[Variable] | None = None) -> BoundSet:
    return bind(load_measurements(folder), inputs, outputs or [ANGLE])


def test_inputs_and_outputs_come_in_the_order_of_the_model(write_case: WriteCase) -> None:
    folder = write_case({"a.csv": "time,q2,u2,q1,u1\n0,1,2,3,4\n1,1,2,3,4\n"})

    result = bound(folder, [Variable("u1"), Variable("u2")], [Variable("q1"), Variable("w"), Variable("q2")])

    assert result.input_names == ("u1", "u2")
    assert result.output_names == ("q1", "q2")
    (trial,) = result.trials
    assert trial.inputs.tolist() == [[4, 2], [4, 2]]
    assert trial.outputs.tolist() == [[3, 1], [3, 1]]
    assert trial.time.tolist() == [0, 1]


@pytest.mark.parametrize("name", ["alpha_1", "alpha[1]", "arm.alpha"])
def test_a_column_matches_a_variable_with_brackets_or_dots_by_spelling(write_case: WriteCase, name: str) -> None:
    column = {"arm.alpha": "arm_alpha"}.get(name, "alpha_1")
    folder = write_case({"a.csv": f"time,q,{column}\n0,1,7\n1,1,7\n"})
    result = bound(folder, [Variable(name)])
    assert result.trials[0].inputs.tolist() == [[7], [7]]
    assert result.unconnected_inputs == ()


def test_an_equal_name_goes_before_an_equal_spelling(write_case: WriteCase) -> None:
    folder = write_case({"a.csv": "time,q,a_1,a[1]\n0,1,7,8\n1,1,7,8\n"})
    result = bound(folder, [Variable("a[1]")])
    assert result.trials[0].inputs[0, 0] == 8
    assert result.unused_columns == ("a_1",)


def test_the_table_variables_goes_before_an_equal_name(write_case: WriteCase) -> None:
    folder = write_case({"a.csv": DATA}, '[variables]\nextra = "u"\n')
    result = bound(folder, [Variable("u")])
    assert result.trials[0].inputs[:, 0].tolist() == [5, 5, 5]
    assert result.unused_columns == ("u",)


def test_a_mapping_to_no_variable_of_the_model_is_noted(write_case: WriteCase) -> None:
    folder = write_case({"a.csv": DATA}, '[variables]\nu = "foce"\n')
    result = bound(folder, [Variable("u")])
    assert result.unconnected_inputs == ("u",)
    assert any("'u' is mapped to 'foce', which is no input" in n for n in result.notes)


def test_an_input_without_a_column_is_held_at_its_start_value_or_zero(write_case: WriteCase) -> None:
    folder = write_case({"a.csv": DATA})
    result = bound(folder, [Variable("F", "N", start=2.5), Variable("v", "V")])
    assert result.unconnected_inputs == ("F", "v")
    assert result.trials[0].inputs.tolist() == [[2.5, 0.0]] * 3
    assert "input F has no column and is held at 2.5 N" in result.notes


def test_values_are_converted_into_the_units_of_the_model_with_a_note(write_case: WriteCase) -> None:
    folder = write_case({"a.csv": DATA}, '[columns]\nq = "deg"\nu = "kN"\n')
    result = bound(folder, [Variable("u", "N")])
    expected = np.array([[10.0], [20.0], [30.0]]) * np.pi / 180
    np.testing.assert_allclose(result.trials[0].outputs, expected, rtol=1e-12)
    assert result.trials[0].inputs[:, 0].tolist() == [1000, 2000, 3000]
    assert any("multiplied by 1000 (kN to N)" in note for note in result.notes)


def test_a_unit_that_nobody_gave_is_taken_from_the_model_with_a_note(write_case: WriteCase) -> None:
    result = bound(write_case({"a.csv": DATA}), [])
    assert result.trials[0].outputs[:, 0].tolist() == [10, 20, 30]
    assert any("unit of column 'q' is not given; taken as rad" in n for n in result.notes)


def test_a_unit_of_another_dimension_is_refused_with_both_sides_named(write_case: WriteCase) -> None:
    folder = write_case({"a.csv": DATA}, '[columns]\nq = "N"\n')
    with pytest.raises(MisfitError) as caught:
        bound(folder, [])
    message = str(caught.value)
    assert "a.csv: column 'q' in 'N' cannot be model variable 'q' in 'rad'" in message
    assert "[columns]" in message
    assert "[variables]" in message


def test_data_without_any_output_are_refused_with_both_lists(write_case: WriteCase) -> None:
    with pytest.raises(MisfitError) as caught:
        bound(write_case({"a.csv": DATA}), [Variable("u")], [Variable("phi")])
    assert "outputs: 'phi'; columns: 'u', 'q', 'extra'" in str(caught.value)


def test_a_column_that_one_trial_lacks_is_named_with_the_trial(write_case: WriteCase) -> None:
    folder = write_case({"a.csv": DATA, "b.csv": "time,u\n0,1\n1,1\n"})
    with pytest.raises(MisfitError, match=r"b\.csv: no column 'q'"):
        bound(folder, [])


def test_noise_is_given_in_the_unit_of_the_model(write_case: WriteCase) -> None:
    case = '[columns]\nq = "deg"\n[sensors]\nencoder_noise_std_deg = 90.0\n'
    result = bound(write_case({"a.csv": DATA}, case), [])
    assert result.noise_std == {"q": pytest.approx(np.pi / 2)}


def test_noise_is_estimated_without_looking_at_held_out_trials(write_case: WriteCase) -> None:
    def data(sigma: float) -> str:
        q = np.random.default_rng(3).normal(0.0, sigma, 2000)
        return "time,q\n" + "".join(f"{k},{v}\n" for k, v in enumerate(q))

    case = "learning = [1]\nheld_out = [2]\n"
    result = bound(write_case({"a.csv": data(1.0), "b.csv": data(100.0)}, case), [])
    # 2000 samples of a MAD estimate: standard error below 5 %.
    assert result.noise_std["q"] == pytest.approx(1.0, rel=0.2)


def test_stimulation_pulses_become_an_excitation_between_zero_and_one(write_case: WriteCase) -> None:
    stimulation = np.zeros(200)
    stimulation[[50, 60, 70]] = 7.95
    rows = "".join(f"{k / 1000},{s},1\n" for k, s in enumerate(stimulation))
    folder = write_case({"a.csv": "time,u,q\n" + rows}, "learning=[1]\n[columns]\nu='V'\n")

    result = bound(folder, [Variable("u", "1", minimum=0.0, maximum=1.0)])

    excitation = result.trials[0].inputs[:, 0]
    assert np.flatnonzero(excitation).tolist() == list(range(50, 80))
    assert set(excitation) == {0.0, 1.0}
    assert result.noise_std["u"] == 0.0
    assert any("train of pulses at 100 Hz: u is 1" in note for note in result.notes)


def test_the_same_pulses_stay_as_they_are_for_an_input_without_that_range(write_case: WriteCase) -> None:
    rows = "".join(f"{k},{7.95 * (k % 10 == 5)},1\n" for k in range(60))
    folder = write_case({"a.csv": "time,u,q\n" + rows}, "learning = [1]\n")
    result = bound(folder, [Variable("u", "V")])
    assert result.trials[0].inputs[:, 0].max() == 7.95


def test_a_smooth_command_beyond_its_range_is_kept_with_a_warning(write_case: WriteCase) -> None:
    result = bound(write_case({"a.csv": DATA}), [Variable("u", "1", minimum=0.0, maximum=1.0)])
    assert result.trials[0].inputs[:, 0].tolist() == [1, 2, 3]
    (warning,) = [note for note in result.notes if note.startswith("warning")]
    assert "'u' spans [1, 3] 1, outside [0, 1] 1 of u; nothing is clipped" in warning


def test_learning_and_held_out_trials_stay_apart(write_case: WriteCase) -> None:
    case = "learning = [2]\nheld_out = [1]\n"
    result = bound(write_case({"a.csv": DATA, "b.csv": DATA}, case), [])
    assert [trial.name for trial in result.learning] == ["b.csv"]
    assert [trial.name for trial in result.held_out] == ["a.csv"]


def test_stretches_take_the_noise_of_whole_trials_and_what_is_noted_of_it(write_case: WriteCase) -> None:
    """A record of two samples shows no noise, and what it has is noted as none."""
    time = np.arange(400) * 0.01
    noisy = np.sin(time) + 0.1 * np.random.default_rng(0).normal(size=len(time))
    rows = [f"{t},{t:.6f},{q:.6f}" for t, q in zip(time, noisy, strict=True)]
    whole = bound(write_case({"a.csv": "\n".join(["time,u,q", *rows])}), [Variable("u")])
    short = bound(write_case({"a.csv": "\n".join(["time,u,q", *rows[:2]])}), [Variable("u")])
    assert whole.noise_of("q").std == pytest.approx(0.1, rel=0.3)
    assert short.noise_of("q").std < 0.05

    found = short.with_noise_of(whole)

    assert found.trials is short.trials
    assert (found.noise_std, found.noise_of("q"), found.notes) == (whole.noise_std, whole.noise_of("q"), whole.notes)
