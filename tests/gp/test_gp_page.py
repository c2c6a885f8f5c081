"""The examples of the page run as they stand."""

import re
from pathlib import Path

import numpy as np

PAGE = Path(__file__).parents[2] / "docs" / "gp.md"


def test_the_examples_find_what_they_were_made_of():
    names: dict = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL):
        exec(block, names)
    off = np.abs(names["mean"] - np.cos([[0.2, 0.1]]))
    assert np.all(off < 3.0 * names["spread"])
    assert np.all(names["spread"] < 0.2)
    assert names["slope"].shape == (1, 2, 2)
    assert names["learner"].count == 39
