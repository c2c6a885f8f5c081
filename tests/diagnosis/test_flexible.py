"""Which forces count as structure though no card describes them."""

import numpy as np
import pytest

from orchestrator.diagnosis.linear.flexible import flexible_forces
from orchestrator.diagnosis.linear.response import SimulatedTrial
from orchestrator.models.smoothing import Smoother

TIME = np.arange(0, 12, 0.005)
ANGLE = np.column_stack([np.sin(1.3 * TIME) + 0.4 * np.sin(3.1 * TIME), np.cos(2.2 * TIME)])
SPEED = np.gradient(ANGLE, TIME, axis=0)


@pytest.mark.parametrize(
    "size",
    [np.ones_like(TIME), 1 + 0.8 * ANGLE[:, 0] ** 2, 1 + 0.1 * TIME, np.abs(SPEED[:, 1])],
    ids=["steady", "of position", "of time", "of another speed"],
)
def test_dry_friction_of_a_size_that_changes_is_followed_but_near_rest(size: np.ndarray) -> None:
    """Within AT_REST of rest the sign is blurred: some percent of the samples, of less than the whole force each."""
    trial = SimulatedTrial(TIME, np.zeros((len(TIME), 1)), ANGLE, Smoother(0.005, 20.0))
    friction = -np.sign(SPEED[:, 0]) * size
    columns = flexible_forces([trial])[0][:, 0, :]

    left = friction + columns @ np.linalg.lstsq(columns, -friction, rcond=1e-9)[0]

    assert np.mean(left**2) < 0.05 * np.mean(friction**2)
