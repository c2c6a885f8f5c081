"""The C sources of FMUs under strict compilers, sanitizers, valgrind and threads."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Sequence
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import pytest
from fmpy import read_model_description  # type: ignore[import-untyped]
from helpers_hybrid import HYBRID

from fmus.archive import extract_fmu
from fmus.build import SUFFIXES, Target, build_all
from fmus.catalogue import built_in_models
from fmus.runtime.compiler import find_compiler

DRIVER = Path(__file__).with_name("exercise")
STRICT = ["-std=c99", "-pedantic", "-Wall", "-Wextra", "-Werror"]
# Generated functions have the parameters of CasADi's convention, whether they use them or not.
STRICT += ["-Wno-unused-parameter"]
# A header of the FMI 3.0 standard declares two callbacks without a prototype, which Clang mentions.
STRICT += ["-Wno-strict-prototypes"]
MEMORY = ["-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-fno-omit-frame-pointer"]
RACES = ["-g", "-fsanitize=thread"]
PLAIN = ["-g", "-O1"]
BOTH = [("hybrid", version) for version in SUFFIXES]


@pytest.fixture(scope="session")
def fmus(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], Path]:
    """Unpacked FMUs by model and FMI version."""
    folder = tmp_path_factory.mktemp("exercise")
    targets = [Target(HYBRID, version, folder / f"hybrid{version}.fmu") for version in SUFFIXES]
    targets.append(Target(built_in_models()["arm"], "3.0", folder / "arm3.0.fmu"))
    build_all(targets, workers=1)
    files = {(target.model.name, target.fmi_version): target.path for target in targets}
    return {key: extract_fmu(path, path.with_suffix(".d")) for key, path in files.items()}


@pytest.fixture(scope="session")
def plain(fmus: dict[tuple[str, str], Path], tmp_path_factory: pytest.TempPathFactory) -> Callable[[str, str], Path]:
    """The driver with the sources of one FMU, compiled when first asked for."""
    folder = tmp_path_factory.mktemp("plain")

    @cache
    def program(model: str, version: str) -> Path:
        return _compile(find_compiler(), PLAIN, fmus[model, version], version, folder / f"{model}{version}")

    return program


def _compile(compiler: Sequence[str], flags: Sequence[str], fmu: Path, version: str, program: Path) -> Path:
    sources = sorted(map(str, (fmu / "sources").glob("*.c")))
    driver = [str(DRIVER / "main.c"), str(DRIVER / f"fmi{version[0]}.c")]
    command = [*compiler, "-std=c99", *flags, f"-I{fmu / 'sources'}", "-o", str(program), *driver, *sources]
    done = subprocess.run([*command, "-lm", "-pthread"], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr[:3000]
    return program


def _arguments(fmu: Path, threads: int) -> list[str]:
    """What the driver is told of the model; at most 30 parameters."""
    description = read_model_description(str(fmu))

    def listed(causality: str) -> str:
        chosen = [v for v in description.modelVariables if v.causality == causality and v.type in ("Real", "Float64")]
        return " ".join(f"{v.valueReference}:{_values(v)}" for v in chosen[:30])

    facts = [description.guid, description.numberOfContinuousStates, description.numberOfEventIndicators]
    step = description.defaultExperiment.stepSize
    return [*map(str, facts), str(step), listed("input"), listed("output"), listed("parameter"), str(threads)]


def _values(variable: object) -> int:
    count = 1
    for dimension in variable.dimensions:  # type: ignore[attr-defined]
        count *= int(dimension.start)
    return count


def _run(command: Sequence[str], **environment: str) -> list[str]:
    done = subprocess.run(
        command, env={**os.environ, **environment}, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, f"{done.returncode} {done.stderr[-3000:]}"
    return done.stdout.split()


@pytest.mark.parametrize(("model", "version"), BOTH)
def test_a_whole_life_is_clean_under_address_and_undefined_behaviour_sanitizers(
    model: str, version: str, fmus: dict[tuple[str, str], Path], tmp_path: Path
) -> None:
    fmu = fmus[model, version]
    program = _compile(find_compiler(), MEMORY, fmu, version, tmp_path / "life")
    assert _run([str(program), *_arguments(fmu, 1)], ASAN_OPTIONS="detect_leaks=1", UBSAN_OPTIONS="print_stacktrace=1")


@pytest.mark.parametrize(("model", "version"), [*BOTH, ("arm", "3.0")])
def test_a_whole_life_leaks_nothing_under_valgrind(
    model: str, version: str, fmus: dict[tuple[str, str], Path], plain: Callable[[str, str], Path]
) -> None:
    if shutil.which("valgrind") is None:
        pytest.skip("valgrind is not installed")
    checks = ["--quiet", "--leak-check=full", "--show-leak-kinds=all", "--errors-for-leak-kinds=all"]
    command = [str(plain(model, version)), *_arguments(fmus[model, version], 1)]
    assert _run(["valgrind", *checks, "--error-exitcode=99", *command])


@pytest.mark.parametrize(("model", "version"), [*BOTH, ("arm", "3.0")])
def test_instances_in_sixteen_threads_get_the_bits_they_get_alone(
    model: str, version: str, fmus: dict[tuple[str, str], Path], plain: Callable[[str, str], Path]
) -> None:
    digests = _run([str(plain(model, version)), *_arguments(fmus[model, version], 16)])

    assert len(set(digests)) == 16  # the inputs differ from thread to thread


@pytest.mark.parametrize("version", SUFFIXES)
def test_threads_share_nothing_that_the_thread_sanitizer_sees(
    version: str, fmus: dict[tuple[str, str], Path], tmp_path: Path
) -> None:
    fmu = fmus["hybrid", version]
    program = _compile(find_compiler(), RACES, fmu, version, tmp_path / "life")
    command = [str(program), *_arguments(fmu, 8)]
    # It places its memory at fixed addresses, which a randomised address space may have taken already.
    fixed = ["setarch", os.uname().machine, "-R"] if shutil.which("setarch") else []
    assert len(_run([*fixed, *command])) == 8


def _compilers() -> list[list[str]]:
    found = [[name] for name in ("gcc", "clang", "tcc") if shutil.which(name)]
    return found + ([[sys.executable, "-m", "ziglang", "cc"]] if find_spec("ziglang") else [])


@pytest.mark.parametrize("version", SUFFIXES)
@pytest.mark.parametrize("compiler", _compilers(), ids=lambda command: command[-2:][0])
def test_sources_are_plain_c99_without_a_warning(
    compiler: list[str], version: str, fmus: dict[tuple[str, str], Path], tmp_path: Path
) -> None:
    fmu = fmus["hybrid", version]
    program = _compile(compiler, STRICT, fmu, version, tmp_path / "life")
    assert _run([str(program), *_arguments(fmu, 2)])
