"""The keys of [sensors]: which quantity of which sensor they state, in which unit."""

import re
from collections.abc import Mapping
from dataclasses import dataclass

from fmus.errors import MisfitError
from fmus.units import conversion, si_exponents
from orchestrator.measurements.wording import shown

_KEY = re.compile(r"(?:(?P<sensor>.+)_)?(?P<quantity>noise_std|resolution)_(?P<unit>.+)")


@dataclass(frozen=True)
class SensorKey:
    """`encoder_noise_std_rad` taken apart: sensor "encoder", quantity "noise_std", unit "rad"."""

    sensor: str
    quantity: str
    unit: str


def sensor_key(key: str) -> SensorKey | None:
    """Take a key of [sensors] apart; None if it states neither noise nor resolution.

    A quotient is written with `_` or `_per_`, because TOML keys hold no slash.

    Raises:
        MisfitError: the key ends in something that is no unit.

    Example:
        >>> sensor_key("gyro_noise_std_rad_s").unit
        'rad/s'
        >>> sensor_key("rate_hz") is None
        True
    """
    match = _KEY.fullmatch(key)
    if match is None:
        return None
    unit = match["unit"].replace("_per_", "/").replace("_", "/")
    try:
        si_exponents(unit)
    except MisfitError as error:
        raise MisfitError(
            f"{shown(key)}: {shown(match['unit'])} is no unit; expected a key such as encoder_noise_std_rad or force_resolution_N"
        ) from error
    return SensorKey(match["sensor"] or "", match["quantity"], unit)


def declared(sensors: Mapping[str, float], quantity: str, unit: str, column: str = "") -> float | None:
    """Look up what [sensors] states for columns in `unit`, converted into `unit`.

    A key named after the column itself goes before a key named after a sensor; of several sensors
    in the same dimension the largest value counts, because nobody says which one the column is.
    rad and 1 are different here: the noise of an encoder says nothing about an activation.

    Args:
        sensors: `[sensors]` of `case.toml`: values by `<sensor>_<quantity>_<unit>`.
        quantity: such as `noise_std` or `resolution`.
        unit: of the column.
        column: its name.

    Returns:
        The value in `unit`, None if nothing is stated or `unit` is unknown ("").
    """
    if not unit:
        return None
    of_column: list[float] = []
    of_any: list[float] = []
    for text, value in sensors.items():
        key = sensor_key(text)
        if key is None or key.quantity != quantity:
            continue
        if si_exponents(key.unit).exponents == si_exponents(unit).exponents:
            converted = value * conversion(key.unit, unit)
            (of_column if key.sensor == column else of_any).append(converted)
    return max(of_column or of_any, default=None)
