"""Shipped records at a lower rate and with fewer trials: the same claims in a fraction of the seconds."""

import re
from collections.abc import Sequence
from pathlib import Path


def thinned(case: Path, folder: Path, every: int, learning: Sequence[str] = (), held_out: Sequence[str] = ()) -> Path:
    """Write a case with one row in `every` of its files, or of those that are named, into a folder, and return that."""
    text = (case / "case.toml").read_text()
    text = re.sub(r"rate_hz = ([\d.]+)", lambda found: f"rate_hz = {float(found[1]) / every}", text)
    if learning:
        files = [*learning, *held_out]
        numbers = list(range(1, len(files) + 1))
        text = re.sub(r"files = .*", f"files = {files}", text)
        text = re.sub(r"\nlearning = .*", f"\nlearning = {numbers[: len(learning)]}", text)
        text = re.sub(r"\nheld_out = .*", f"\nheld_out = {numbers[len(learning) :]}", text)
    (folder / "case.toml").write_text(text.replace("'", '"'))
    for file in case.glob("*.csv"):
        head, *rows = file.read_text().splitlines()
        (folder / file.name).write_text("\n".join([head, *rows[::every]]) + "\n")
    return folder
