"""The case file of records that several rooms' tests make: three trials, of which the last is held out."""

from collections.abc import Mapping, Sequence


def three_trials(
    units: Mapping[str, str], files: Sequence[str] = ("trial_1", "trial_2", "trial_3"), straight: str = ""
) -> str:
    """Text of `case.toml` for three CSV files with a column `t` in s and further ones with their units.

    It says of a `straight` one that it runs in straight lines between samples; otherwise that is left open, and a diagnosis asks.
    """
    names = ", ".join(f'"{name}.csv"' for name in files)
    columns = "\n".join(f'{name} = "{unit}"' for name, unit in {"t": "s", **units}.items())
    between = f'[interpolation]\n{straight} = "linear"\n' if straight else ""
    return f'files = [{names}]\nlearning = [1, 2]\nheld_out = [3]\n[columns]\n{columns}\n[variables]\nt = "time"\n{between}'
