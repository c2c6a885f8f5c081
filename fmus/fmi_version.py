"""What differs between the FMI versions when an FMU is put together."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from fmus.arrays import array_sizes, array_variables
from fmus.description_parts import Header, build_description
from fmus.errors import FmuError
from fmus.layout import Layout
from fmus.model_description import model_description
from fmus.platforms import Platform
from fmus.symbolic.system import SymbolicSystem
from fmus.terminals import FILE as TERMINALS
from fmus.terminals import terminals_xml


def _nothing(layout: Layout, header: Header) -> Mapping[str, bytes]:
    return {}


def _parts3(layout: Layout, header: Header) -> Mapping[str, bytes]:
    terminals = terminals_xml(array_variables(layout.scalars))
    parts = {"sources/buildDescription.xml": build_description(header.identifier, header.sources)}
    return parts if terminals is None else {**parts, TERMINALS: terminals}


def _no_headers(layout: Layout) -> Mapping[str, str]:
    return {}


@dataclass(frozen=True)
class FmiVersion:
    """One version of the standard: its layer of the runtime, its headers and its descriptions."""

    prefix: str  # of the runtime's files
    headers: tuple[str, ...]
    describe: Callable[[SymbolicSystem, Header], bytes]
    platform: Callable[[], str]  # folder of the binary for this machine
    folder: Callable[[Platform], str]  # of the binary for another platform
    headers_of: Callable[[Layout], Mapping[str, str]] = _no_headers  # about one model, beside the common ones
    adjoint: bool = False  # whether the version has adjoint derivatives
    parts: Callable[[Layout, Header], Mapping[str, bytes]] = _nothing  # by archive path

    def has_runtime_file(self, name: str) -> bool:
        """Whether a file of the runtime belongs to this version: its own layer and all that knows no version."""
        return name.endswith((".c", ".h")) and (name.startswith(self.prefix) or not name.startswith("fmi"))


def find_version(name: str) -> FmiVersion:
    """Return the version called `2.0` or `3.0`.

    Raises:
        FmuError: if there is no such version.
    """
    if name not in _VERSIONS:
        raise FmuError(f"FMI version {name!r} cannot be built; choose {' or '.join(_VERSIONS)}")
    return _VERSIONS[name]


def _platform2() -> str:
    from fmpy import platform  # type: ignore[import-untyped]

    return str(platform)


def _platform3() -> str:
    from fmpy import platform_tuple

    return str(platform_tuple)


_VERSIONS = {
    "2.0": FmiVersion(
        prefix="fmi2",
        headers=("fmi2Functions.h", "fmi2FunctionTypes.h", "fmi2TypesPlatform.h"),
        describe=lambda system, header: model_description(system, header, 2),
        platform=_platform2,
        folder=lambda platform: platform.folder2,
    ),
    "3.0": FmiVersion(
        prefix="fmi3",
        headers=("fmi3Functions.h", "fmi3FunctionTypes.h", "fmi3PlatformTypes.h"),
        describe=lambda system, header: model_description(system, header, 3),
        platform=_platform3,
        folder=lambda platform: platform.name,
        headers_of=lambda layout: {"model_arrays.h": array_sizes(array_variables(layout.scalars))},
        adjoint=True,
        parts=_parts3,
    ),
}
