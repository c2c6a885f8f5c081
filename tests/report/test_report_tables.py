"""Terminal tables hold the numbers of the result and survive a pipe."""

import io
import math
import re
from dataclasses import replace

import pytest
from builders import comparison, diagnosis, entries
from rich.console import Console, RenderableType

from orchestrator.cli.common import wrapped
from orchestrator.compare.result import SetErrors
from orchestrator.report.answer import answer_of
from orchestrator.report.numbers import quantity
from orchestrator.report.tables import (
    LedgerTable,
    bar,
    comparison_table,
    diagnosis_table,
    verdict_sentence,
)
from orchestrator.verdicts.result import Estimate, NamedEffect, Verdict


def piped(what: RenderableType) -> str:
    stream = io.StringIO()
    Console(file=stream, width=100, highlight=False).print(what)
    return stream.getvalue()


def test_a_ledger_in_a_pipe_fits_100_columns_without_colour_codes() -> None:
    text = piped(LedgerTable(entries(diagnosis())))

    assert "\x1b" not in text
    assert max(len(line) for line in text.splitlines()) <= 100


def test_the_ledger_holds_each_version_with_its_errors_and_all_its_effects() -> None:
    versions = entries(diagnosis())

    text = piped(LedgerTable(versions))

    assert "tauC[1] = 0.0373 N.m [0.0361, 0.0385]" in text
    with_friction = [entry for entry in versions if any(e.id == "coulomb_friction" for e in entry.effects)]
    assert text.count("Coulomb friction at joint1") == len(with_friction) == 2
    for entry in versions:
        assert entry.held_out is not None
        for errors in (entry.learning, entry.held_out):
            assert all(quantity(value, "rad") in text for value in errors.rmse.values())


def test_the_bar_is_half_as_long_when_the_error_has_halved() -> None:
    first, second, _ = entries(diagnosis())
    versions = [
        replace(first, held_out=SetErrors({"q1": 0.1}, 100.0)),
        replace(second, held_out=SetErrors({"q1": 0.05}, 50.0)),
    ]

    lengths = [line.count("█") + ("▌" in line) / 2 for line in piped(LedgerTable(versions)).splitlines()]

    assert [length for length in lengths if length] == [7, 3.5]


@pytest.mark.parametrize("error", [math.inf, math.nan, 0.0])
def test_a_version_whose_error_is_no_ordinary_number_is_still_shown(error: float) -> None:
    first, second, _ = entries(diagnosis())

    text = piped(LedgerTable([first, replace(second, held_out=SetErrors({"q1": error}, error))]))

    assert "Arm_1" in text


@pytest.mark.parametrize(("share", "length"), [(-1.0, 0), (0.0, 0), (0.5, 4), (1.0, 8), (7.0, 8), (math.nan, 0)])
def test_a_bar_never_leaves_its_column(share: float, length: int) -> None:
    assert len(bar(share, 8)) == length


def test_a_comparison_without_held_out_trials_speaks_of_the_learning_trials() -> None:
    text = piped(comparison_table(comparison(n_held_out=0)))

    assert "does not explain the learning trials" in text
    assert "held" not in text


def test_a_comparison_shows_the_error_of_every_trial_and_signal() -> None:
    found = comparison()

    text = piped(comparison_table(found))

    for trial in found.trials:
        lines = [line for line in text.splitlines() if line.startswith(trial.file)]
        for line, (signal, value) in zip(lines, trial.rmse.items(), strict=True):
            assert signal in line
            assert quantity(value, "rad") in line


def test_brackets_in_names_are_not_read_as_markup() -> None:
    found = comparison(signals=("arm.q[bold]",))

    assert "arm.q[bold]" in piped(comparison_table(found))


def test_a_terminal_escape_in_a_file_name_does_not_reach_the_terminal() -> None:
    found = comparison()
    trials = tuple(replace(trial, file="\x1b[2Jtrial\r.csv") for trial in found.trials)

    text = piped(comparison_table(replace(found, trials=trials)))

    assert "\x1b" not in text
    assert "[2Jtrial" in text


def test_the_terminal_names_the_answer_first_and_then_what_came_closest() -> None:
    text = piped(diagnosis_table(diagnosis()))

    assert text.startswith("Coulomb friction at joint1 and payload at wrist are missing.")
    assert "1 Coulomb friction at joint1 and" in text
    assert "muscle1" in text and "muscle6" not in text
    assert "more sets were tried" in text


def test_at_eighty_columns_no_number_of_the_terminal_is_broken() -> None:
    stream = io.StringIO()
    Console(file=stream, width=80, highlight=False).print(diagnosis_table(diagnosis()))

    assert "38.5)" in stream.getvalue() and max(map(len, stream.getvalue().splitlines())) <= 80


@pytest.mark.parametrize("verdict", ["adequate", "named", "cannot_tell"])
def test_the_terminal_says_what_is_left_open_and_what_to_do_next(verdict: Verdict) -> None:
    computed = {"effects": ["coulomb_friction", "payload"], "do": "reverse slowly", "probability_to_separate": 0.98}
    found = replace(diagnosis(verdict), next_experiment={**computed, "expected_gain": 12.0})

    text = " ".join(piped(diagnosis_table(found)).split())

    assert text.count("tauC[1] was pinned by 12 reversals only.") == 1
    do = "That experiment" if verdict == "cannot_tell" else "Next experiment: reverse slowly. It"
    assert f"{do} tells apart Coulomb friction and payload with a probability of 98 %" in text
    assert "a repetition would separate them 12.0 times less." in text


def test_an_experiment_that_only_a_card_knows_is_said_without_figures() -> None:
    found = replace(diagnosis("ambiguous"), next_experiment={"effects": ["payload"], "do": "hold a known mass"})

    text = piped(diagnosis_table(found))

    assert text.count("hold a known mass") == 1 and "Next: Record this: hold a known mass.\n" in text
    assert "with a probability" not in text


@pytest.mark.parametrize(
    ("verdict", "words"),
    [
        ("adequate", "Nothing is missing that these data can show."),
        (
            "named",
            "Coulomb friction at joint1 and payload at wrist are missing. Size: tauC[1] 37.3 mN·m (36.1 to 38.5)",
        ),
        ("ambiguous", "these data cannot tell which: Coulomb friction at joint1 or viscous friction."),
        ("unknown", "Something is missing that no effect in the library explains."),
        ("cannot_tell", "These data cannot tell whether anything is missing."),
    ],
)
def test_every_verdict_is_a_plain_sentence(verdict: Verdict, words: str) -> None:
    assert words in verdict_sentence(diagnosis(verdict))


def test_what_rivals_share_is_said_to_be_missing_and_their_difference_with_its_place() -> None:
    found = diagnosis("ambiguous")
    document = found.to_json()
    sites = {"cubic_stiffness": "z", "passive_stiffness": "z"}
    document["effects"] = [{**document["effects"][0], "id": id, "site": site} for id, site in sites.items()]
    document["effects"].append({**document["effects"][0], "id": "parameter_error", "site": "R"})
    document["confusable"] = [["passive_stiffness", "parameter_error"]]
    first = {"effects": ["cubic_stiffness", "passive_stiffness", "parameter_error"], "sites": ["z", "z", "R"]}
    second = {"effects": ["cubic_stiffness", "parameter_error", "parameter_error"], "sites": ["z", "R", "k"]}
    document["ranking"] = [{**first, "score": 1.0, "probability": 0.5}, {**second, "score": 1.0, "probability": 0.5}]
    assert answer_of(document).headline == (
        "Cubic stiffness at z is missing and the model's value of R is wrong, and beside that one of these, which the data cannot"
        " tell apart: passive stiffness at z or the value of k."
    )


EXPERIMENT = {
    "do": "reverse each joint slowly",
    "effects": ("coulomb_friction", "viscous_friction"),
    "probability_to_separate": 0.97,
    "expected_gain": 1.0,
}


@pytest.mark.parametrize("verdict", ["adequate", "named", "ambiguous", "unknown", "cannot_tell"])
def test_a_terminal_says_the_answer_and_the_next_step_of_every_verdict_first_and_nothing_twice(
    verdict: Verdict,
) -> None:
    """What is adequate had no next step; a proposed experiment was named twice, as what is next and once more."""
    found = replace(diagnosis(verdict), next_experiment=EXPERIMENT)
    answer = answer_of(found.to_json())

    text = " ".join(piped(diagnosis_table(found)).split())

    assert text.startswith(f"{answer.headline} ")
    assert text.index(f"Next: {answer.next_step}") == len(answer.text) + 1
    assert text.count("reverse each joint slowly") == 1
    assert text.count("with a probability of 97 %") == 1


def test_what_is_written_already_is_not_to_be_added() -> None:
    written = replace(diagnosis("named"), patched_model="found/Plant_1.fmu")

    assert answer_of(written.to_json()).next_step == "Use Plant_1.fmu, the model with them."


def test_two_effects_are_them_in_every_sentence() -> None:
    answer = answer_of(diagnosis("named").to_json())

    assert "Adding them takes the error" in answer.detail and answer.next_step == "Add them to the model."
    assert not re.search(r"\bit\b", f"{answer.detail} {answer.caution}")


def test_the_verdict_without_held_out_trials_claims_nothing_about_them() -> None:
    assert "No trial was held out" in verdict_sentence(diagnosis(n_held_out=0))


def test_an_effect_without_parameters_or_interval_can_be_named() -> None:
    bare = NamedEffect("backlash", "", {})
    sharp = NamedEffect("payload", "wrist", {"m": Estimate(0.5, "kg", (0.5, 0.5))})
    text = verdict_sentence(replace(diagnosis(), effects=(bare, sharp)))

    assert "Backlash and payload at wrist are missing. Size: m 0.500 kg (0.500 to 0.500)." in text


def test_no_number_and_no_name_of_a_ledger_is_broken_at_80_columns() -> None:
    console = Console(width=80, record=True, file=io.StringIO())
    shown = [replace(each, name="RatGastrocnemius_12") for each in entries(diagnosis("named"))]

    console.print(LedgerTable(shown))

    text = console.export_text()
    assert text.count("RatGastrocnemius_12") == len(shown), "a name is cut"
    assert max(map(len, text.splitlines())) <= 80
    for effect in shown[-1].effects:
        for estimate in effect.parameters.values():
            assert all(f"{value:.4g}" in text for value in (estimate.value, *estimate.ci90))


def test_lines_on_a_terminal_break_between_words_and_keep_their_indent() -> None:
    long = "/a/path/that/is/longer/than/the/line.json"

    assert wrapped(f"  off by 1.25 rad\n{long}", 12) == f"  off by\n  1.25 rad\n{long}"
    assert wrapped("short", 12) == "short"
