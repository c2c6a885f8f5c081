"""The first thing that a user sees of an unknown model: what it was understood as."""

from pathlib import Path

import pytest

from fmus.catalogue import ModelicaModel
from fmus.package import build_fmu
from orchestrator.blackbox.source import FmuSource
from orchestrator.measurements import load_measurements
from orchestrator.understood import understood

GALLERY = Path(__file__).parent / "cases" / "gallery"


def lines(name: str, class_name: str) -> list[str]:
    source = ModelicaModel(class_name, class_name, GALLERY / name / "Model.mo")
    return understood(source, load_measurements(GALLERY / name))


def test_states_come_with_unit_balance_and_place() -> None:
    text = (GALLERY / "overhead_crane" / "Model.mo").read_text().splitlines()
    force, torque = (next(k for k, line in enumerate(text, 1) if key in line) for key in ("F = (M", "m*l^2*der"))
    found = lines("overhead_crane", "Crane")
    assert found[0] == "Model Crane: 4 states, 1 input, 2 outputs, 4 parameters"
    assert "  x [m]: follows from other variables, no balance equation" in found
    assert f"  v [m/s]: balance of forces in N, Model.mo:{force}" in found
    assert f"  w [rad/s]: balance of torques in N.m, Model.mo:{torque}" in found
    places = next(k for k, line in enumerate(found) if line.startswith("Places for an effect: 2 balance equations"))
    assert "the paths of 1 input and 2 outputs" in found[places]
    tried, later = {}, {}
    for line in found[places + 1 :]:
        where, _, names = line.strip().removeprefix("at ").partition(": ")
        tried[where], _, later[where] = names.partition("; if these leave much: ")
    assert {"rate limit", "input delay"} <= set(later["inputs"].split(", "))
    assert "sensor lag" in later["outputs"].split(", ")
    assert {"viscous friction", "Coulomb friction"} <= set(tried["balances"].split(", "))
    assert {"input gain", "saturation"} <= set(tried["inputs"].split(", "))
    assert {"zero error", "scale error"} <= set(tried["outputs"].split(", "))


def test_columns_are_told_with_the_variables_that_they_are() -> None:
    found = lines("cylinder", "Cylinder")
    assert "Data: 3 learning and 2 held-out trials, 6000 rows, 12 s" in found
    assert "  output p[1] [Pa] from column p_1" in found


@pytest.mark.parametrize(("name", "class_name", "terms"), [("two_rooms", "House.Plant", "heat flows in W")])
def test_a_balance_speaks_the_language_of_its_domain(name: str, class_name: str, terms: str) -> None:
    found = lines(name, class_name)
    assert any(terms in line for line in found)
    assert any("heat loss" in line for line in found) and not any("friction" in line for line in found)


def test_an_fmu_is_told_by_what_its_rates_show(tmp_path: Path) -> None:
    (tmp_path / "Cart.mo").write_text(
        'model Cart parameter Real m(unit="kg") = 2; input Real F(unit="N"); output Real x(unit="m", start=0, fixed=true);'
        ' Real v(unit="m/s", start=0, fixed=true); equation der(x) = v; m*der(v) = F; end Cart;'
    )
    (tmp_path / "trial.csv").write_text("time,F,x\n" + "".join(f"{k / 10},{k % 3},{k / 50}\n" for k in range(20)))
    measurements = load_measurements(str(tmp_path))
    fmu = build_fmu(ModelicaModel("Cart", "Cart", tmp_path / "Cart.mo").compile(), tmp_path / "Cart.fmu")
    text = "\n".join(understood(FmuSource.prepare(fmu, measurements), measurements))
    assert "FMU Cart (model exchange): 2 states, 1 input, 1 output, 1 parameter" in text
    assert "v [m/s]: balance of forces in N" in text and "input F [N] from column F" in text
    stepped = understood(FmuSource.prepare(fmu, measurements, stepped=True), measurements)
    assert stepped[-1] == "Places for an effect: the paths of 1 input and 1 output, the values of 1 parameter"


def test_units_that_only_a_number_can_mend_are_told_first(tmp_path: Path) -> None:
    (tmp_path / "Vessel.mo").write_text(
        'model Vessel\n  input Real Q(unit="W");\n  output Real T(unit="K", start=350, fixed=true);\nequation\n'
        "  60*der(T) = Q*exp((T - 350)/8);\nend Vessel;\n"
    )
    (tmp_path / "trial.csv").write_text("time,Q,T\n" + "".join(f"{k},{k % 3},{350 + k / 9}\n" for k in range(20)))
    source = ModelicaModel("Vessel", "Vessel", tmp_path / "Vessel.mo")
    found = understood(source, load_measurements(str(tmp_path)))
    assert any(line.startswith("  Vessel.mo:5: the argument of exp has unit K") for line in found)


def test_gas_at_a_pressure_is_no_heat(tmp_path: Path) -> None:
    (tmp_path / "Chamber.mo").write_text(
        'model Chamber\n  parameter Real V(unit="m3") = 0.05, S(unit="m3/s") = 0.04;\n  input Real q(unit="Pa.m3/s");\n'
        '  output Real p(unit="Pa", start=2, fixed=true);\nequation\n  V*der(p) = q - S*p;\nend Chamber;\n'
    )
    (tmp_path / "trial.csv").write_text("time,q,p\n" + "".join(f"{k},{k % 3},{2 + k / 9}\n" for k in range(20)))
    source = ModelicaModel("Chamber", "Chamber", tmp_path / "Chamber.mo")
    found = "\n".join(understood(source, load_measurements(str(tmp_path))))
    assert "p [Pa]: balance of gas flows in Pa.m3/s" in found
    assert "constant flow" in found and "leak" in found and "heat" not in found
