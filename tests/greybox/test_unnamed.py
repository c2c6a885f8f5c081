"""What no law of the library can say is not named by laws that come near it."""

from pathlib import Path

import pytest
from plants import diagnosed, slide_record


@pytest.mark.parametrize(("law", "coordinate"), [("quintic", "x"), ("one-way", "v")])
def test_laws_that_come_near_a_force_of_no_library_are_the_best_set_and_not_named(
    law: str, coordinate: str, tmp_path: Path
) -> None:
    force = {"quintic": lambda x, v: -3e4 * x**5, "one-way": lambda x, v: -2.0 * max(v, 0.0) ** 2}[law]
    found = diagnosed(slide_record(tmp_path, force, seed=21, samples=200, said=True))
    assert found.verdict == "unknown" and found.best
    assert f"some other force over {coordinate} predicts" in " ".join(found.warnings)
