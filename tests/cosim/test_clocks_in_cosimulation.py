"""Clocks of FMI 3.0 in co-simulation: ticks pass from FMU to FMU at their own times, with the values that belong to them."""

import subprocess
import zipfile
from pathlib import Path

import fmpy
import pytest
from systems import spec

from fmus.errors import MisfitError
from fmus.runtime.compiler import find_compiler
from fmus.validate import validate_fmu
from orchestrator.cosim import ComponentSpec, Connection, RunSettings, Simulation, System
from orchestrator.cosim.container import container_of
from orchestrator.cosim.load import load_system
from orchestrator.cosim.ssp import write_ssp

SOURCE = Path(__file__).parent / "fmus" / "station.c"
DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="station" instantiationToken="{station}">
 <CoSimulation modelIdentifier="station" hasEventMode="true" canHandleVariableCommunicationStepSize="true"/>
 <ModelVariables>
  <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
  <Clock name="beat" valueReference="1" causality="input" intervalVariability="constant" intervalDecimal="0.1"/>
  <Clock name="Port.Rx_Clock" valueReference="2" causality="input" intervalVariability="triggered"/>
  <Clock name="Port.Tx_Clock" valueReference="3" causality="output" intervalVariability="triggered"/>
  <Clock name="reply" valueReference="4" causality="input" intervalVariability="countdown"/>
  <Binary name="Port.Rx_Data" valueReference="5" causality="input" variability="discrete" clocks="2"><Start value=""/></Binary>
  <Binary name="Port.Tx_Data" valueReference="6" causality="output" variability="discrete" clocks="3"/>
  <Binary name="answer" valueReference="7" causality="output" variability="discrete" clocks="4"/>
  <Float64 name="say" valueReference="8" causality="input" variability="discrete" start="0"/>
  <Float64 name="heard" valueReference="9" causality="output" variability="discrete"/>
  <Float64 name="heard_at" valueReference="10" causality="output" variability="discrete"/>
  <Float64 name="ticked" valueReference="11" causality="output" variability="discrete" clocks="1"/>
 </ModelVariables>
 <ModelStructure>
  <Output valueReference="3"/><Output valueReference="6"/><Output valueReference="7"/><Output valueReference="9" dependencies=""/>
  <Output valueReference="10" dependencies=""/><Output valueReference="11"/>
  <InitialUnknown valueReference="3"/><InitialUnknown valueReference="9"/><InitialUnknown valueReference="10"/>
 </ModelStructure>
</fmiModelDescription>"""
_MEMBERS = "".join(
    f'<TerminalMemberVariable variableKind="signal" variableName="Port.{name}" memberName="{name}"/>'
    for name in ("Rx_Clock", "Tx_Clock", "Rx_Data", "Tx_Data")
)
TERMINALS = f"""<fmiTerminalsAndIcons fmiVersion="3.0"><Terminals>
 <Terminal name="Port" matchingRule="org.fmi-ls-bus.transceiver">{_MEMBERS}</Terminal>
</Terminals></fmiTerminalsAndIcons>"""
SENDS = (Connection("a.Port.Tx_Clock", "b.Port.Rx_Clock"), Connection("a.Port.Tx_Data", "b.Port.Rx_Data"))
ANSWERS = (Connection("b.reply", "a.Port.Rx_Clock"), Connection("b.answer", "a.Port.Rx_Data"))


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The FMU."""
    folder = tmp_path_factory.mktemp("station")
    headers = Path(fmpy.__file__).parent / "c-code"
    flags = ["-DFMI3_OVERRIDE_FUNCTION_PREFIX", f"-I{headers}", "-shared", "-fPIC", "-O1"]
    subprocess.run(
        [*find_compiler(), *flags, "-o", "station.so", str(SOURCE), str(SOURCE.with_name("absent.c"))],
        cwd=folder,
        check=True,
    )
    with zipfile.ZipFile(folder / "station.fmu", "w") as archive:
        archive.writestr("modelDescription.xml", DESCRIPTION)
        archive.writestr("terminalsAndIcons/terminalsAndIcons.xml", TERMINALS)
        archive.write(folder / "station.so", "binaries/x86_64-linux/station.so")
    return folder / "station.fmu"


def two(station: Path, *connections: Connection, step: float = 0.02, master: str = "ordered", **more: object) -> System:
    parts = {name: ComponentSpec(name, source=str(station), **more) for name in "ab"}
    return System("two", parts, connections, run=RunSettings(step=step, master=master), folder=Path("/"))


@pytest.mark.parametrize("master", ["ordered", "jacobi", "gauss_seidel"])
@pytest.mark.parametrize("step", [0.01, 0.02, 0.7])
def test_ticks_arrive_at_their_own_times_whatever_the_step(master: str, step: float, station: Path) -> None:
    with Simulation(two(station, *SENDS, *ANSWERS, step=step, master=master), stop=0.7) as run:
        run.run(0.7)

        # Beats 1 to 8 at 0, 0.1, ... 0.7; each is answered 0.03 s later with the sum so far, the last one not any more.
        assert run.get("b.heard") == sum(range(1, 9)) and run.get("b.heard_at") == pytest.approx(0.7, abs=1e-12)
        assert run.get("a.heard") == 1 + 3 + 6 + 10 + 15 + 21 + 28
        assert run.get("a.heard_at") == pytest.approx(0.63, abs=1e-12)
        assert run.report.ticks["a.Port.Tx_Clock"].count == 8 and run.report.ticks["b.reply"].count == 7
        assert any(line.startswith("clock b.reply ticked 7 times, last at t = 0.63 s") for line in run.report.lines)


def test_a_value_that_belongs_to_a_clock_is_recorded_as_of_its_last_tick(station: Path) -> None:
    with Simulation(two(station, *SENDS, step=0.05), stop=0.25) as run:
        seen = [
            run.coupling.values[slot.first]
            for _ in range(5)
            if run.step()
            for slot in run.coupling.wiring.slots
            if slot.address == "a.ticked"
        ]
    assert seen == [1, 2, 2, 3, 3]


def test_terminals_of_a_network_are_joined_by_one_connection(station: Path) -> None:
    with Simulation(two(station, Connection("a.Port", "b.Port")), stop=0.25) as run:
        run.run(0.25)
        # Both send at 0, 0.1 and 0.2, and hear each other.
        assert (run.get("a.heard"), run.get("b.heard")) == (6, 6)


def test_a_system_with_terminals_goes_through_ssp(station: Path, tmp_path: Path) -> None:
    file = tmp_path / "two.toml"
    parts = "".join(f'[components.{name}]\nfmu = "{station}"\n' for name in "ab")
    file.write_text(f'[run]\nstep = 0.05\n{parts}[[connections]]\nfrom = "a.Port"\nto = "b.Port"\n')

    write_ssp(load_system(file), tmp_path / "two.ssp")

    with Simulation(load_system(tmp_path / "two.ssp"), stop=0.25) as run:
        run.run(0.25)
        assert (run.get("a.heard"), run.get("b.heard")) == (6, 6)


def test_a_station_has_no_findings_though_it_runs_with_event_mode_only(station: Path) -> None:
    assert validate_fmu(station) == []


def test_a_discrete_input_that_changes_is_an_event_of_its_own(station: Path) -> None:
    with Simulation(two(station, *SENDS, step=0.05), stop=0.1) as run:
        run.step()
        before = run.get("b.heard")
        run.set("a.say", 40.0)
        run.step(0.01)
        assert run.get("b.heard") == before + 40 and run.get("b.heard_at") == pytest.approx(0.05)


def test_what_cannot_tick_is_refused_in_a_line(station: Path, tmp_path: Path) -> None:
    with pytest.raises(
        MisfitError, match="the clocks of a do not tick: that takes an FMU for co-simulation with event mode"
    ):
        Simulation(two(station, *SENDS, isolate=True))
    with pytest.raises(MisfitError, match="clocks tick in a, b, for which master 'adaptive' makes no room"):
        Simulation(two(station, *SENDS, master="adaptive"))
    with pytest.raises(MisfitError, match="a, b: clocks tick in misfit run, but not in one FMU"):
        container_of(two(station, *SENDS), "coupled", tmp_path)
    with pytest.raises(MisfitError, match="b.beat.*constant clock, which ticks by itself; expected a triggered one"):
        Simulation(two(station, Connection("a.Port.Tx_Clock", "b.beat")))
    with pytest.raises(MisfitError, match="event mode and early_return do not go together"):
        Simulation(two(station, *SENDS, options={"early_return": True}))
    gain = spec("gain", "gain")
    with pytest.raises(MisfitError, match="Float64 does not fit a clock"):
        wrong = two(station)
        Simulation(
            System("w", {**wrong.components, "gain": gain}, (Connection("gain.y", "a.Port.Rx_Clock"),), run=wrong.run)
        )
    with pytest.raises(MisfitError, match="event_mode: .* has no event mode"):
        Simulation(
            System("w", {"gain": spec("gain", "gain")}, run=wrong.run).with_component(
                ComponentSpec("gain", source=gain.source, options={"interface": "CoSimulation", "event_mode": True})
            )
        )
