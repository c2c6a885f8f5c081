"""FMUs of both versions as components: values of every type, arrays, steps, refusals, and why one cannot be loaded."""

import math
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from small_fmus import small_fmu

from fmus.errors import ComponentError, FmuError
from orchestrator.cosim.component import Component
from orchestrator.cosim.fmu import open_fmu, read_description
from orchestrator.cosim.system import ComponentSpec


def opened(path: Path, **options: object) -> Component:
    return open_fmu(ComponentSpec(path.stem, source=path.name, options=options), path.parent)


def started(component: Component, **values: object) -> Component:
    component.set(list(values), list(values.values()))
    component.initialise(0.0, None, None)
    component.start()
    return component


VALUES = {"float64": 1.5, "int32": -7, "boolean": True, "string": "größer", "enumeration": 2}
VALUES3 = {
    **VALUES,
    "float32": 0.25,
    "int8": -128,
    "uint8": 255,
    "int16": -32768,
    "uint16": 65535,
    "uint32": 2**32 - 1,
    "int64": -(2**63),
    "uint64": 2**64 - 1,
    "binary": b"\x00\x01\xff",
}


@pytest.mark.parametrize(("version", "values"), [(2, VALUES), (3, VALUES3)])
def test_every_type_passes_through_an_fmu_unchanged(version: int, values: dict[str, object]) -> None:
    fmu = started(opened(small_fmu("feedthrough", version)))
    fmu.set([f"{name}_in" for name in values], list(values.values()))
    assert fmu.get([f"{name}_out" for name in values]) == list(values.values())
    fmu.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_start_values_of_the_description_are_those_of_the_fmu(version: int) -> None:
    path = small_fmu("feedthrough", version)
    fmu = started(opened(path))
    described = {p.name: p.start for p in read_description(path).ports if p.start is not None and p.type != "Binary"}
    assert fmu.get(list(described)) == list(described.values())
    fmu.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_a_tunable_parameter_can_be_changed_between_steps(version: int) -> None:
    fmu = started(opened(small_fmu("feedthrough", version)), tunable=1.0)
    fmu.step(0.0, 0.1)
    fmu.set(["tunable"], [2.0])
    assert fmu.get(["tuned"]) == [2.0]
    fmu.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_a_ball_is_where_its_parabola_is_after_the_first_bounce(version: int) -> None:
    ball = started(opened(small_fmu("ball", version), interface="CoSimulation"))
    for k in range(60):
        ball.step(0.01 * k, 0.01)
    fall = math.sqrt(2.0 / 9.81)
    up, since = 0.7 * 9.81 * fall, 0.6 - fall
    assert ball.get(["h"]) == [pytest.approx(up * since - 0.5 * 9.81 * since**2, abs=1e-12)]
    ball.terminate()


def test_a_step_ends_early_at_an_event_only_where_that_is_asked_for() -> None:
    fall = math.sqrt(2.0 / 9.81)
    for early, reached in ((True, fall), (False, 0.5)):
        ball = started(opened(small_fmu("ball", 3), interface="CoSimulation", early_return=early))
        end = ball.step(0.0, 0.5)
        assert (end.time, end.early) == (pytest.approx(reached, rel=1e-12), early)
        ball.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_a_run_goes_on_alike_from_a_saved_state(version: int) -> None:
    ball = started(opened(small_fmu("ball", version), interface="CoSimulation"))
    ball.step(0.0, 0.3)
    state = ball.save()
    ball.step(0.3, 0.3)
    first = ball.get(["h", "v"])
    ball.restore(state)
    ball.step(0.3, 0.3)
    assert ball.get(["h", "v"]) == first
    ball.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_tells_its_own_derivatives(version: int) -> None:
    spring = started(opened(small_fmu("spring", version), interface="CoSimulation"), k=10.0, d=3.0)
    assert spring.derivative(["f1", "f2"], ["x2", "v1"], [1.0, 2.0]) == [10.0 - 6.0, -10.0 + 6.0]
    spring.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_a_file_in_resources_is_read(version: int) -> None:
    fmu = started(opened(small_fmu("resource", version)))
    assert fmu.get(["y"]) == [ord("a")]
    fmu.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_a_stair_ends_the_run_at_its_top(version: int) -> None:
    stair = started(opened(small_fmu("stair", version), interface="CoSimulation"))
    ends = [stair.step(0.5 * k, 0.5) for k in range(20)]
    assert [end.terminated for end in ends] == [False] * 19 + [True]
    assert stair.get(["counter"]) == [10]
    stair.terminate()


def test_arrays_follow_their_structural_parameters() -> None:
    fmu = opened(small_fmu("statespace", 3))
    a, b = np.array([[-1.0, 2.0], [0.0, -3.0]]), np.array([[1.0], [2.0]])
    values = {"n": 2, "m": 1, "r": 2, "a": a, "b": b, "c": np.eye(2), "d": np.zeros((2, 1)), "u": np.array([4.0])}
    started(fmu, **values, x0=np.array([1.0, -1.0]))
    fmu.step(0.0, 0.001)
    x = np.array([1.0, -1.0])
    (y,) = fmu.get(["y"])
    np.testing.assert_allclose(y, x + 0.001 * (a @ x + b @ [4.0]), rtol=1e-14)
    fmu.terminate()


def test_an_array_of_the_wrong_size_is_refused() -> None:
    fmu = opened(small_fmu("statespace", 3))
    with pytest.raises(ComponentError, match="'statespace': 'u' has 3 elements, got 2"):
        started(fmu, u=np.array([1.0, 2.0]))
    fmu.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_a_refused_step_names_fmu_time_step_and_message(version: int) -> None:
    fmu = started(opened(small_fmu("decay", version), interface="CoSimulation"), longest=0.05)
    fmu.step(0.0, 0.05)
    words = (
        "FMU 'decay' refused the step at t = 0.05 s (step 0.1 s): status Discard; last good state is t = 0.05 s; "
        "it says: the step does not suit me (7)"
    )
    with pytest.raises(ComponentError) as caught:
        fmu.step(0.05, 0.1)
    assert str(caught.value) == words
    fmu.terminate()


@pytest.mark.parametrize(("version", "said"), [(2, "does not suit me (%u)"), (3, "does not suit me (7)")])
def test_without_a_compiler_messages_of_fmi_2_lack_their_arguments(
    version: int, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    from orchestrator.cosim.engine import native

    monkeypatch.setattr(native, "native_library", lambda: None)
    fmu = started(opened(small_fmu("decay", version), interface="CoSimulation"), longest=0.05)
    with pytest.raises(ComponentError) as caught:
        fmu.step(0.0, 0.1)
    assert str(caught.value).endswith(said)
    fmu.terminate()


def test_a_refused_value_names_variable_value_and_message() -> None:
    path = small_fmu("mass", replace={'name="fb" valueReference="1"': 'name="fb" valueReference="77"'})
    mass = started(opened(path, interface="CoSimulation"))
    with pytest.raises(
        ComponentError,
        match=r"'mass' refused fmi2SetReal of 'fb' = 2.5 N at t = 0 s: status Error; it says: there is no variable 77",
    ):
        mass.set(["fb"], [2.5])
    mass.terminate()


def test_a_value_of_the_wrong_type_is_refused() -> None:
    mass = started(opened(small_fmu("mass"), interface="CoSimulation"))
    with pytest.raises(ComponentError, match="FMU 'mass': fa = 'much' is no Float64"):
        mass.set(["fa"], ["much"])
    mass.terminate()


@pytest.mark.parametrize("version", [2, 3])
def test_an_fmu_of_sources_is_compiled(version: int) -> None:
    fmu = started(opened(small_fmu("decay", version, sources=True), interface="CoSimulation"))
    fmu.step(0.0, 1.0)
    assert fmu.get(["x"]) == [pytest.approx(math.exp(-1.0), rel=1e-15)]
    fmu.terminate()


def test_sources_with_a_mistake_give_the_first_error_of_the_compiler(tmp_path: Path) -> None:
    broken = tmp_path / "decay.fmu"
    with zipfile.ZipFile(small_fmu("decay", sources=True)) as archive, zipfile.ZipFile(broken, "w") as new:
        for name in archive.namelist():
            new.writestr(name, archive.read(name) if name != "sources/decay.c" else b"nonsense;")
    with pytest.raises(FmuError, match="decay.fmu: its sources do not compile: .*error"):
        opened(broken)


def test_missing_binary_tool_and_sources_are_told_apart() -> None:
    with pytest.raises(FmuError, match="has no binary mass.so for linux64, and no sources; it has win64/mass.so"):
        opened(small_fmu("mass", platform="win64"))
    tool = {'modelIdentifier="mass"': 'modelIdentifier="mass" needsExecutionTool="true"'}
    with pytest.raises(FmuError, match=r"needs its tool \(tests\) to run"):
        opened(small_fmu("mass", platform="win64", replace=tool))


def test_a_binary_of_another_architecture_is_named() -> None:
    path = small_fmu("mass")
    library = bytearray(zipfile.ZipFile(path).read("binaries/linux64/mass.so"))
    library[18:20] = (183).to_bytes(2, "little")
    with pytest.raises(FmuError, match="mass.so is built for aarch64-linux with 64 bits, this machine is x86_64-linux"):
        opened(_with_binary(path, "aarch64", bytes(library)))


def test_a_file_that_is_no_library_is_named() -> None:
    with pytest.raises(FmuError, match="mass.so is built for Windows"):
        opened(_with_binary(small_fmu("mass"), "windows", b"MZ" + bytes(100)))


def _with_binary(path: Path, name: str, library: bytes) -> Path:
    changed = path.parent / f"{name}.fmu"
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(changed, "w") as new:
        new.writestr("modelDescription.xml", archive.read("modelDescription.xml"))
        new.writestr("binaries/linux64/mass.so", library)
    return changed


def test_a_missing_library_that_a_binary_needs_is_named(tmp_path: Path) -> None:
    library, binary = tmp_path / "libvendor.so", tmp_path / "mass.so"
    source = tmp_path / "vendor.c"
    source.write_text("int vendor(void) { return 1; }")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", str(library), str(source)], check=True)
    source.write_text("int vendor(void); int fmi2GetVersion(void) { return vendor(); }")
    command = ["cc", "-shared", "-fPIC", "-o", str(binary), str(source), f"-L{tmp_path}", "-lvendor"]
    subprocess.run(command, check=True)
    with pytest.raises(FmuError, match="mass.so needs the library libvendor.so, which is not installed; install it"):
        opened(_with_binary(small_fmu("mass"), "missing", binary.read_bytes()))
    subprocess.run(command[:-2], check=True)
    with pytest.raises(FmuError, match="mass.so uses vendor, which no library provides"):
        opened(_with_binary(small_fmu("mass"), "undefined", binary.read_bytes()))


def test_an_fmu_that_may_be_there_once_is_not_made_twice() -> None:
    once = {'modelIdentifier="mass"': 'modelIdentifier="mass" canBeInstantiatedOnlyOncePerProcess="true"'}
    path = small_fmu("mass", replace=once)
    first = opened(path, interface="CoSimulation")
    with pytest.raises(ComponentError, match="only once per process and is already there as 'mass'"):
        opened(path, interface="CoSimulation")
    first.terminate()
    opened(path, interface="CoSimulation").terminate()


def test_a_description_from_the_cache_is_the_same(tmp_path: Path) -> None:
    path = small_fmu("spring", 3)
    copy = tmp_path / "spring.fmu"
    copy.write_bytes(path.read_bytes())
    first, second = read_description(path), read_description(copy)
    assert first.ports == second.ports
    assert first.feedthrough == second.feedthrough == {name: ("x1", "v1", "x2", "v2") for name in ("f1", "f2")}
