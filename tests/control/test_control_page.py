"""The example of the page runs and shows what it says."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "control.md"


def test_what_was_learned_in_the_example_takes_most_of_the_error_away():
    names: dict = {}
    for block in re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL):
        exec(block, names)
    before, after = (sum(each.error for each in names[key]) for key in ("held", "better"))
    assert after < 0.5 * before
    assert names["margins"].decay > 0
