"""A symbolic system as an FMU for co-simulation and model exchange."""

import hashlib
import io
import uuid
import zipfile
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from importlib import resources
from pathlib import Path

from fmus.archive import check_entry_name
from fmus.description_parts import Header
from fmus.errors import FmuError
from fmus.files import write_atomically
from fmus.fmi_version import FmiVersion, find_version
from fmus.layout import Layout
from fmus.platforms import Platform, cross_compile, universal
from fmus.runtime.compiler import compile_library
from fmus.runtime.generated import (
    model_code,
    model_config,
    model_functions,
    model_identifier,
)
from fmus.symbolic.system import SymbolicSystem
from fmus.trust import trust


def build_fmu(
    system: SymbolicSystem,
    path: Path,
    *,
    fmi_version: str = "2.0",
    stop_time: float = 10.0,
    step_size: float = 0.004,
    tolerance: float = 1e-8,
    extra_files: Mapping[str, bytes] = {},
    platforms: Sequence[Platform] = (),
) -> Path:
    """Write the FMU of a system to `path`, with its sources, and give the path back.

    Equal models give equal bytes. A file that was at `path` is replaced in one go, or left as it was
    when the build fails.

    Args:
        system: the model.
        path: file to write; its folder must exist.
        fmi_version: `2.0` or `3.0`.
        stop_time, step_size: default experiment, s; the step is that of communication.
        tolerance: relative error per internal step, used unless the importer asks for another one.
        extra_files: archive path -> content, such as `resources/model.mo`.
        platforms: what to build binaries for beside the machine that builds.

    Raises:
        FmuError: without a C compiler, or when the system contradicts itself.
        MisfitError: if a unit is unknown.
    """
    check_system(system)
    fmi = find_version(fmi_version)
    sources = _sources(system, fmi, tolerance)
    units = sorted(name for name in sources if name.endswith(".c"))
    header = Header(model_identifier(system.name), "", units, stop_time, step_size, tolerance)
    guid = fingerprint({**_encoded(sources), "": fmi.describe(system, header), **extra_files})
    header = replace(header, guid=guid)
    sources["model_config.h"] = sources["model_config.h"].replace(_NO_GUID, guid)
    files = {
        "modelDescription.xml": fmi.describe(system, header),
        **library_files(fmi, header.identifier, sources, platforms, shared=_shared(fmi)),
        **{f"sources/{name}": content for name, content in _encoded(sources).items()},
        **fmi.parts(Layout(system), header),
    }
    for name, content in extra_files.items():
        check_entry_name(name)
        if name in files:
            raise FmuError(f"extra file {name!r} would replace a part of the FMU; choose another name")
        files[name] = content
    content = zipped(files)
    try:
        write_atomically(path, content)
        trust(hashlib.sha256(content).hexdigest(), f"built from {system.name}")
    except OSError as error:
        raise FmuError(f"cannot write {path}: {error.strerror}") from error
    return path


_NO_GUID = "{00000000-0000-0000-0000-000000000000}"


def check_system(system: SymbolicSystem) -> None:
    """Raise FmuError when names repeat, or when a function and its variables differ in number."""
    named = (
        *system.inputs,
        *system.states,
        *system.algebraics,
        *system.parameters,
        *system.dependents,
    )
    names = [variable.name for variable in named]
    for name in names:
        if names.count(name) > 1:
            raise FmuError(f"model {system.name!r}: the variable {name!r} occurs {names.count(name)} times")
    for name in system.outputs:
        if all(name != v.name for v in (*system.states, *system.algebraics)):
            raise FmuError(f"model {system.name!r}: output {name!r} is neither a state nor an algebraic variable")
    x, u, p = len(system.states), len(system.inputs), len(system.parameters)
    z, q, d = len(system.algebraics), len(system.dependents), system.n_delays
    expected = {
        "rhs": ([1, x, u, d, p], [x, z]),
        "history": ([1, u, p], [d, d]),
        "dependent": ([p], [q]),
        "initial": ([p], [x]),
        "consistent": ([1, u, p, x], [x]),
    }
    for name, function in model_functions(system).items():
        sizes = (
            [function.numel_in(i) for i in range(function.n_in())],
            [function.numel_out(i) for i in range(function.n_out())],
        )
        if sizes != expected[name]:
            raise FmuError(
                f"model {system.name!r}: function {name} has sizes {sizes[0]} -> {sizes[1]}; "
                f"its variables ask for {expected[name][0]} -> {expected[name][1]}"
            )


def _sources(system: SymbolicSystem, fmi: FmiVersion, tolerance: float) -> dict[str, str]:
    """All C files by name; the configuration still carries `_NO_GUID`."""
    code = model_code(system, reverse=fmi.adjoint)
    layout = Layout(system)
    names = [scalar.variable.name for scalar in layout.scalars]
    return {
        **_shared(fmi),
        **fmi.headers_of(layout),
        "model.c": code.functions,
        "model_config.h": model_config(system, code, names, _NO_GUID, tolerance),
    }


def _shared(fmi: FmiVersion) -> dict[str, str]:
    """The C files that all models have."""
    runtime = resources.files("fmus.runtime")
    files = {f.name: f.read_text("utf-8") for f in runtime.iterdir() if fmi.has_runtime_file(f.name)}
    return {**files, **headers(fmi), "fmi.h": f'#include "{fmi.prefix}.h"\n'}


def headers(fmi: FmiVersion) -> dict[str, str]:
    """The headers of the standard, which FMPy brings along."""
    import fmpy  # type: ignore[import-untyped]

    folder = Path(fmpy.__file__).parent / "c-code"
    return {name: (folder / name).read_text("utf-8") for name in fmi.headers}


def library_files(
    fmi: FmiVersion,
    identifier: str,
    sources: Mapping[str, str],
    platforms: Sequence[Platform],
    shared: Collection[str] = (),
) -> dict[str, bytes]:
    """Libraries by archive path: one for this machine, made by its own compiler, and those for other platforms.

    Args:
        fmi: version of FMI, which names the folders.
        identifier: the model's, which names the files.
        sources: C text by file name.
        platforms: others than this machine.
        shared: names of files that all models share, see `compile_library`.

    Raises:
        FmuError: without a C compiler, or with the first error of one.
    """
    from fmpy import platform_tuple, sharedLibraryExtension

    folders: dict[str, dict[Platform, bytes]] = {}
    others = [platform for platform in platforms if platform.name != platform_tuple]
    for platform, library in cross_compile(sources, others).items():
        name = f"binaries/{fmi.folder(platform)}/{identifier}{platform.ending}"
        folders.setdefault(name, {})[platform] = library
    native = f"binaries/{fmi.folder()}/{identifier}{sharedLibraryExtension}"
    return {
        **{name: universal(libraries) for name, libraries in folders.items()},
        native: compile_library(sources, shared),
    }


def _encoded(sources: Mapping[str, str]) -> dict[str, bytes]:
    return {name: text.encode() for name, text in sources.items()}


def fingerprint(files: Mapping[str, bytes]) -> str:
    """A GUID made of the content, so that models differ in it exactly when they differ."""
    digest = hashlib.sha256()
    for name in sorted(files):
        digest.update(f"{name}\0{len(files[name])}\0".encode() + files[name])
    return "{" + str(uuid.UUID(bytes=digest.digest()[:16])) + "}"


def zipped(files: Mapping[str, bytes], first: str = "modelDescription.xml") -> bytes:
    """An archive of files by their paths, the `first` one before the others; equal files give equal bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files, key=lambda name: (name != first, name)):
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system = 3
            mode = 0o755 if name.startswith("binaries/") else 0o644
            entry.external_attr = (0o100000 | mode) << 16
            archive.writestr(entry, files[name])
    return buffer.getvalue()
