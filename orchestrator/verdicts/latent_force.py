"""A force that no effect of the library explains, as a curve over the two coordinates that tell most about it."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

# A curve that explains less of what is left than this says nothing.
TELLS = 0.1


@dataclass(frozen=True)
class LatentForce:
    """A force curve for one signal, with its 90 % band.

    `coordinates` are the two coordinates, the more informative first; `explained` is the share of the residual's square
    that the curve explains on blocks of time left out, with the first coordinate alone and with both. `at` are values
    of the first coordinate; `force`, `low` and `high` the curve there, the second coordinate at its median. `surface`
    holds the curve over both: `surface_at` are values of the second, rows belong to the first.
    """

    signal: str
    unit: str
    coordinates: tuple[str, str]
    coordinate_units: tuple[str, str]
    explained: tuple[float, float]
    at: tuple[float, ...]
    force: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    surface_at: tuple[float, ...]
    surface: tuple[tuple[float, ...], ...]

    def to_json(self) -> dict[str, Any]:
        """Return it as plain lists."""
        return {key: _plain(value) for key, value in asdict(self).items()}

    def sentence(self) -> str:
        """Say what the curve shows."""
        first, second = self.coordinates
        largest = int(np.argmax(np.abs(self.force)))
        if max(self.explained) < TELLS:
            most = max(0.0, *self.explained)
            return f"what is left of {self.signal} goes with nothing that was recorded; {first} explains {100 * most:.0f} % of it"
        return (
            f"what is left of {self.signal} depends most on {first}, then on {second}: both explain"
            f" {100 * self.explained[1]:.0f} % of it on data left out ({first} alone {100 * self.explained[0]:.0f} %); it is largest,"
            f" {self.force[largest]:.3g} {self.unit}, at {first} = {self.at[largest]:.3g} {self.coordinate_units[0]}"
        )

    def draft_card(self, number: int) -> str:
        """A draft of an effect card (TOML): what is known, and the curve as a table to write a law from."""
        rows = ["[" + ", ".join(f"{value:.6g}" for value in row) + "]" for row in self.surface]
        return "\n".join(
            [
                "# A draft from a diagnosis that found no effect of the library. Write a Modelica class whose law follows the",
                "# table, name it under `class`, give its parameters, and delete the table (see docs/effect_cards.md).",
                f'id = "draft_{number}"',
                f'title = "Unknown force on {self.signal}, over {self.coordinates[0]} and {self.coordinates[1]}"',
                "",
                "[table]",
                f'signal = "{self.signal}"',
                f'unit = "{self.unit}"',
                f'coordinates = ["{self.coordinates[0]}", "{self.coordinates[1]}"]',
                f'coordinate_units = ["{self.coordinate_units[0]}", "{self.coordinate_units[1]}"]',
                f"first = [{', '.join(f'{value:.6g}' for value in self.at)}]",
                f"second = [{', '.join(f'{value:.6g}' for value in self.surface_at)}]",
                "force = [",
                *(f"  {row}," for row in rows),
                "]",
                "",
            ]
        )


def _plain(value: Any) -> Any:
    return [_plain(part) for part in value] if isinstance(value, tuple) else value
