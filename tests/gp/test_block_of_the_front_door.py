"""A block of `import misfit`: whether its intervals hold, and data that are far worse than their noise."""

from pathlib import Path

import numpy as np
import pytest

import misfit

NOISE = 0.05


def record(seed: int, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points x (n,) and sin(2 x) (n,) with noise."""
    random = np.random.default_rng(seed)
    x = random.uniform(-2.0, 2.0, count)
    return x, np.sin(2 * x) + NOISE * random.standard_normal(count)


@pytest.fixture(scope="module")
def sound() -> misfit.Block:
    x, y = record(1, 60)
    return misfit.Block.fit({"x": x}, {"y": y}, noise={"y": NOISE})


def test_intervals_of_a_sound_block_hold_for_data_it_has_not_seen(sound: misfit.Block) -> None:
    x, y = record(2, 200)

    # 200 draws at 90 %: a standard deviation of 2 %.
    assert sound.coverage({"x": x}, {"y": y}, {"y": NOISE})["y"] == pytest.approx(0.9, abs=0.08)
    assert sound.left_out() == pytest.approx(0.9, abs=0.1)


def test_noise_that_is_stated_too_small_shows(sound: misfit.Block) -> None:
    x, y = record(2, 200)

    assert sound.coverage({"x": x}, {"y": y}, {"y": NOISE / 10})["y"] < 0.7


def test_outliers_move_a_block_little_where_it_expects_them() -> None:
    x, y = record(3, 80)
    y[::8] += 3.0
    at = np.linspace(-1.8, 1.8, 50)

    plain, wary = (misfit.Block.fit({"x": x}, {"y": y}, noise={"y": NOISE}, outliers=each) for each in (False, True))

    errors = [np.sqrt(np.mean((block.predict({"x": at})[0] - np.sin(2 * at)) ** 2)) for block in (plain, wary)]
    assert errors[1] < 0.5 * errors[0]


def test_noise_that_is_missing_is_named(sound: misfit.Block) -> None:
    with pytest.raises(misfit.MisfitError, match="noise of y is missing; expected its standard deviation"):
        sound.coverage({"x": [0.0]}, {"y": [0.0]}, {})


@pytest.mark.parametrize("noise", [1e-2, 1e-4])
def test_data_nearly_without_noise_of_a_straight_line_are_learned(noise: float) -> None:
    """Long length scales leave no factor of the covariance there."""
    x = np.linspace(-4.0, 4.0, 41)
    block = misfit.Block.fit({"x": x}, {"y": -400.0 * x}, noise={"y": noise})
    assert np.abs(block.predict({"x": x})[0] + 400.0 * x).max() < 10.0 * noise


def test_many_data_are_taken_in_through_few_rows_and_intervals_hold(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for where in ("sparse", "learned"):
        monkeypatch.setattr(f"orchestrator.gp.{where}.EXACT", 100)
    monkeypatch.setattr("orchestrator.gp.sparse.ROWS", 40)
    x, y = record(1, 400)
    block = misfit.Block.fit({"x": x}, {"y": y}, noise={"y": NOISE})
    assert len(block.learned.posterior.lower) <= 40

    at = np.linspace(-1.9, 1.9, 50)
    mean, deviation = block.predict({"x": at})
    assert np.sqrt(np.mean((mean - np.sin(2 * at)) ** 2)) < 0.02
    assert np.mean(np.abs(mean - np.sin(2 * at)) < 3 * deviation + 1e-3) > 0.9
    with pytest.raises(misfit.MisfitError, match="400 data were taken in through fewer rows"):
        block.left_out()

    again = misfit.Block.read(block.save(tmp_path / "block.json"))
    assert np.array_equal(again.predict({"x": at}), (mean, deviation))
    more = block.condition({"x": [0.0]}, {"y": [5.0]}, {"y": 1e-3})
    assert len(more.learned.posterior.lower) <= 40
    assert more.predict({"x": [0.0]})[0][0] > 4.0
    with pytest.raises(misfit.MisfitError, match="400 data to look for outliers in; expected at most 100"):
        misfit.Block.fit({"x": x}, {"y": y}, outliers=True)


def test_a_kernel_that_there_is_not_is_refused_with_the_nearest() -> None:
    with pytest.raises(misfit.MisfitError, match="kernel = 'matern5'.*matern52"):
        misfit.Block.fit({"x": [0.0, 1.0]}, {"y": [0.0, 1.0]}, kernel="matern5")
