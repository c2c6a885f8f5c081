"""The force that a model lacks along trials, as a result that draws itself."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fmus.errors import MisfitError
from orchestrator.api.data import Data

if TYPE_CHECKING:
    from orchestrator.shown import Shown


@dataclass(frozen=True, eq=False)
class MissingForce:
    """The missing force along one trial: `mean` and `std` (n, k) in `units`, at `time` (n,) s, one column for each signal."""

    trial: str
    subset: str
    time: np.ndarray
    signals: tuple[str, ...]
    units: tuple[str, ...]
    mean: np.ndarray
    std: np.ndarray


@dataclass(frozen=True)
class Missing:
    """What would have to act beside a model so that it follows the measurement, trial by trial.

    The force acts in the balance equation of each signal, in that equation's unit; a model that lacks nothing shows zero
    within the standard deviation.
    """

    model: str
    trials: tuple[MissingForce, ...]

    @property
    def rms(self) -> dict[str, float]:
        """Root mean square of the missing force on each signal, over all trials, in its unit."""
        every = np.concatenate([trial.mean for trial in self.trials])
        return dict(zip(self.trials[0].signals, np.sqrt(np.mean(every**2, axis=0)).tolist(), strict=True))

    def plot(self, trial: str | None = None) -> "Shown":
        """The missing force over time with its 90 % band, for a notebook; of the first trial if none is named.

        Raises:
            MisfitError: if there is no such trial.
        """
        from orchestrator.report.notebook import forces_plot

        found = next((each for each in self.trials if trial in (None, each.trial)), None)
        if found is None:
            names = ", ".join(each.trial for each in self.trials)
            raise MisfitError(f"there is no trial {trial!r}; there are {names}")
        return forces_plot(found.time, found.signals, found.units, found.mean, found.std)

    def _repr_html_(self) -> str:
        return self.plot()._repr_html_()


def missing(model: Any, data: Data) -> Missing:
    """Find the force that a model lacks along all trials.

    Args:
        model: as `orchestrator.model_argument` gives it.

    Raises:
        MisfitError: if the model does not show which force it lacks.
    """
    from orchestrator.datacheck.holding import with_interpolation
    from orchestrator.models.contract import with_held_inputs
    from orchestrator.models.missing_force import missing_forces
    from orchestrator.models.smoothing import SmoothedTrial

    data = replace(data, measurements=with_interpolation(model, data.measurements))
    bound = data.bound(model.inputs, model.outputs)
    noise = np.array([bound.noise_std[name] for name in bound.output_names])
    trials = [SmoothedTrial(t.time, t.inputs, t.outputs, noise) for t in bound.trials]
    restricted: Any = with_held_inputs(model.restricted(bound.output_names), bound.trials[0].held)
    if restricted.residual is None:
        return Missing(model.name, _of_closed(restricted, trials, bound.trials))
    found = missing_forces(restricted, trials)
    return Missing(
        model.name,
        tuple(
            MissingForce(t.name, t.subset, each.time, each.names, each.units, each.mean, each.std)
            for t, each in zip(bound.trials, found, strict=True)
        ),
    )


def _of_closed(model: Any, trials: list[Any], bound: Any) -> tuple[MissingForce, ...]:
    """The same of an FMU that can be asked for its rates; its deviation is not known."""
    from orchestrator.blackbox.forces import missing_forces

    found = missing_forces(model, trials)
    if not found:
        raise MisfitError(
            f"{model.name} does not show which force it lacks: expected model exchange, measured outputs that show all states, "
            "and an input that acts as a force on each"
        )
    names, units = tuple(name for name, _, _ in found), tuple(unit for _, unit, _ in found)
    return tuple(
        MissingForce(
            bound[k].name,
            bound[k].subset,
            trial.smoother.thin(trial.time),
            names,
            units,
            np.column_stack([series[k] for _, _, series in found]),
            np.full((len(found[0][2][k]), len(found)), np.nan),
        )
        for k, trial in enumerate(trials)
    )
