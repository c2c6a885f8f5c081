"""The pictures of reports with the lines below them."""

from collections.abc import Mapping, Sequence
from typing import Any

from orchestrator.compare.result import Comparison, TrialCurves
from orchestrator.report import figures
from orchestrator.report.arm_drawing import Replay, Scales, replay_html
from orchestrator.report.page import Picture
from orchestrator.report.sentences import effect_name
from orchestrator.verdicts.result import Diagnosis


def moving(replay: Replay | None) -> Picture | None:
    """The replay as a part of a page; its drawing explains itself, as it is no photograph."""
    if replay is None:
        return None
    frames = [replay.instant(k) for k in replay.frames()]
    size = Scales.of(replay.shape, frames).words()
    caption = (
        "Dashed: where the model puts the arm. Round arrows: torque that the model lacks at a joint, with its 90 % band"
        f"{f' ({size})' if size else ''}. Muscles: the more active, the thicker; their distances from joints are their "
        "moment arms, to scale; where they begin and end is not in the model and drawn by eye."
    )
    return Picture(replay_html(replay, "Replay of the worst trial"), caption)


def step_versions(diagnosis: Diagnosis) -> list[figures.Version]:
    """Return the models on the way of a diagnosis, each named by what it adds to the one before."""
    versions: list[figures.Version] = []
    known: set[tuple[str, str]] = set()
    for step in diagnosis.steps:
        added = [effect_name(effect) for effect in step.effects if (effect.id, effect.site) not in known]
        known |= {(effect.id, effect.site) for effect in step.effects}
        name = "+ " + ", ".join(added) if added else "as given"
        versions.append((name, step.comparison.learning, step.comparison.held_out))
    return versions


def falling(versions: Sequence[figures.Version]) -> Picture | None:
    """Return the error of each version; nothing for fewer than two."""
    if len(versions) < 2:
        return None
    return Picture(figures.falling_error(versions), "The error of each version, as a multiple of the noise floor.")


def latent(diagnosis: Diagnosis) -> list[Picture]:
    """Return a curve for each force that no effect explains."""
    return [Picture(figures.latent_curve(curve), f"{curve.sentence()}.") for curve in diagnosis.latent_forces]


def maps(rows: Sequence[Mapping[str, Any]], what: str) -> list[Picture]:
    """A figure for each signal: the four coordinates on which it depends most."""
    pictures = []
    for name in dict.fromkeys(str(row["signal"]) for row in rows if "low" in row):
        mine = [row for row in rows if row["signal"] == name]
        caption = f"Where {what} is: {name} over the quantities it depends on most."
        pictures.append(Picture(figures.error_maps(name, mine), caption))
    return pictures


def trial_pictures(comparison: Comparison, changed: Mapping[tuple[str, str], TrialCurves]) -> list[Picture]:
    """Return the curves of the trials worth a figure; `changed` holds the same trials with the effects in the model."""
    shown = "Measured and modelled curves of {}, with the residual (measured minus modelled) below."
    return [
        Picture(figures.trial_curves(comparison, trial, changed.get((trial.file, trial.set))), shown.format(trial.file))
        for trial in figures.shown_trials(comparison)
    ]


def residual_pictures(comparison: Comparison) -> list[Picture]:
    """Return what the residual depends on: trial first, then state and frequency; nothing without curves."""
    if not comparison.curves:
        return []
    pictures = [Picture(figures.error_by_trial(comparison), "Error of each trial; the dashed line is the noise floor.")]
    for name in figures.shown_signals(comparison):
        caption = f"Residual of {name} against each measured signal and its speed, all trials."
        pictures.append(Picture(figures.residual_against_state(comparison, name), caption))
    pictures += maps(comparison.where.get("state", []), "the error of free runs")
    caption = (
        "Residual by frequency, all trials; the dashed line is the noise floor if it were white, grey is what the same samples"
        " give in random order (95 %)."
    )
    return [*pictures, Picture(figures.residual_spectrum(comparison), caption)]
