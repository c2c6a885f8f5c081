"""Changes of columns that undo what may be wrong with a record."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

Way = Literal["scale", "shift", "swap", "delay", "clock"]


@dataclass(frozen=True)
class Change:
    """A change of the columns of some model variables.

    `scale` multiplies them by `value`, `shift` adds it, `swap` exchanges two of them, `delay` reads them `value` s
    later than recorded, and `clock` multiplies the time. `meaning` says what would be wrong with the record as it is.
    """

    way: Way
    columns: tuple[str, ...]
    value: float
    meaning: str

    def applied(self, time: np.ndarray, values: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Return the changed time (n,) and the changed series (n, k) of the variables `names`."""
        if self.way == "clock":
            return time * self.value, values
        places = [names.index(name) for name in self.columns if name in names]
        changed = values.copy()
        if self.way == "scale":
            changed[:, places] *= self.value
        elif self.way == "shift":
            changed[:, places] += self.value
        elif self.way == "swap" and len(places) == 2:
            changed[:, places] = values[:, places[::-1]]
        elif self.way == "delay":
            for place in places:
                changed[:, place] = np.interp(time - self.value, time, values[:, place])
        return time, changed

    def noise(self, noise: np.ndarray, names: Sequence[str]) -> np.ndarray:
        """Noise (k,) of the changed series."""
        changed = noise.copy()
        places = [names.index(name) for name in self.columns if name in names]
        if self.way == "scale":
            changed[places] *= abs(self.value)
        elif self.way == "swap" and len(places) == 2:
            changed[places] = noise[places[::-1]]
        return changed

    def with_value(self, value: float) -> "Change":
        """The same change by another amount."""
        return Change(self.way, self.columns, value, self.meaning)


NO_CHANGE = Change("scale", (), 1.0, "")
