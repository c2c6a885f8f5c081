"""Maps of an error: they show what it depends on, and stay inside the band where it depends on nothing."""

import numpy as np
import pytest

from orchestrator.compare.maps import Coordinate, coordinates_of, error_map, error_maps, sentence

STEP = 0.01
TIME = np.arange(0, 20, STEP)


def motion(random: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    q = np.sin(1.1 * TIME + random.uniform(0, 6)) + 0.5 * np.sin(2.3 * TIME + random.uniform(0, 6))
    return q, np.gradient(q, TIME)


def slow_noise(random: np.random.Generator, size: int) -> np.ndarray:
    """Noise with a memory of 0.1 s."""
    return np.convolve(random.standard_normal(size + 20), np.ones(21) / 21**0.5, mode="valid")


@pytest.mark.parametrize("coordinate", ["q", "w", "time"])
def test_noise_that_depends_on_nothing_is_called_so_in_nearly_all_draws(coordinate: str) -> None:
    alarms = 0
    for seed in range(30):
        random = np.random.default_rng(seed)
        q, w = motion(random)
        values = {"q": q, "w": w, "time": TIME}[coordinate]
        found = error_map([slow_noise(random, len(TIME))], Coordinate(coordinate, "", (values,)), STEP, seed=seed)
        assert found is not None
        alarms += found.depends

    assert alarms <= 4  # 5 % of 30 is 1.5; more than 4 has a probability of 2 %


def test_error_against_the_sign_of_speed_is_found_there_and_not_in_position() -> None:
    random = np.random.default_rng(0)
    q, w = motion(random)
    error = -0.5 * np.sign(w) + 0.3 * slow_noise(random, len(TIME))
    coordinates = coordinates_of({"q": [q]}, {"q": "rad"}, {}, {}, [TIME])

    maps = [m for m in (error_map([error], c, STEP) for c in coordinates) if m is not None]

    strongest = max(maps, key=lambda m: m.strength)
    assert strongest.against == "speed of q"
    assert strongest.p_value == pytest.approx(0.02)  # no permutation comes near: 2 (1 + 0)/(1 + 99)
    assert np.all(strongest.bias[:3] > 0.3) and np.all(strongest.bias[-3:] < -0.3)
    assert "flips with the sign of speed of q" in sentence("q", maps)


def test_error_at_reversals_is_said_in_words() -> None:
    random = np.random.default_rng(1)
    q, w = motion(random)
    near = np.convolve(np.abs(np.diff(np.sign(w), prepend=0)) > 0, np.ones(21), mode="same") > 0
    error = np.where(near, 2.0, 0.2) * slow_noise(random, len(TIME))
    coordinates = coordinates_of({"q": [q]}, {"q": "rad"}, {}, {}, [TIME])

    maps = [m for m in (error_map([error], c, STEP) for c in coordinates) if m is not None]

    assert sentence("q", maps).startswith("q: largest where q reverses")


def test_rms_of_all_bins_adds_up_to_that_of_the_residual() -> None:
    random = np.random.default_rng(2)
    q, _ = motion(random)
    error = slow_noise(random, len(TIME))

    found = error_map([error[:900], error[900:]], Coordinate("q", "rad", (q[:900], q[900:])), STEP)

    assert found is not None
    assert float(found.count @ found.rms**2) == pytest.approx(float(np.sum(error**2)))
    assert np.all(found.low < found.high)


def test_coordinate_that_never_varies_has_no_map() -> None:
    assert error_map([np.ones(500)], Coordinate("u", "", (np.zeros(500),)), STEP) is None


def test_maps_over_several_coordinates_are_those_over_each() -> None:
    random = np.random.default_rng(3)
    q, w = motion(random)
    w[40:60] = np.nan  # a gap in one of them
    error = slow_noise(random, len(TIME))
    coordinates = [Coordinate(name, "", (values,)) for name, values in (("q", q), ("w", w), ("u", 0 * q), ("t", TIME))]

    together = error_maps([error], coordinates, STEP)

    assert [m is None for m in together] == [False, False, True, False]
    for found, coordinate in zip(together, coordinates, strict=True):
        alone = error_map([error], coordinate, STEP)
        if found is not None and alone is not None:
            for name in ("edges", "rms", "bias", "low", "high", "count", "p_value", "strength"):
                assert np.allclose(getattr(found, name), getattr(alone, name), rtol=1e-9)
