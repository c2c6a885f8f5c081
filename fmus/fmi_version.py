"""What differs between the FMI versions when an FMU is put together."""

from collections.abc import Mapping
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


@dataclass(frozen=True)
class FmiVersion:
    """One version of the standard, `number` 2 or 3: its layer of the runtime, its headers and its descriptions."""

    number: int

    @property
    def prefix(self) -> str:
        """How names of the runtime's files of this version begin."""
        return f"fmi{self.number}"

    @property
    def headers(self) -> tuple[str, ...]:
        """Names of the standard's headers."""
        types = "TypesPlatform" if self.number == 2 else "PlatformTypes"
        return tuple(f"{self.prefix}{part}.h" for part in ("Functions", "FunctionTypes", types))

    @property
    def adjoint(self) -> bool:
        """Whether the version has adjoint derivatives."""
        return self.number == 3

    def has_runtime_file(self, name: str) -> bool:
        """Whether a file of the runtime belongs to this version: its own layer and all that knows no version."""
        return name.endswith((".c", ".h")) and (name.startswith(self.prefix) or not name.startswith("fmi"))

    def describe(self, system: SymbolicSystem, header: Header) -> bytes:
        """The model description."""
        return model_description(system, header, self.number)

    def folder(self, platform: Platform | None = None) -> str:
        """Folder of the binary for a platform; None for this machine."""
        import fmpy  # type: ignore[import-untyped]

        if platform is not None:
            return platform.folder2 if self.number == 2 else platform.name
        return str(fmpy.platform if self.number == 2 else fmpy.platform_tuple)

    def headers_of(self, layout: Layout) -> Mapping[str, str]:
        """Headers about one model, beside the common ones."""
        return {} if self.number == 2 else {"model_arrays.h": array_sizes(array_variables(layout.scalars))}

    def parts(self, layout: Layout, header: Header) -> Mapping[str, bytes]:
        """Further files of an FMU by archive path."""
        if self.number == 2:
            return {}
        terminals = terminals_xml(array_variables(layout.scalars))
        parts = {"sources/buildDescription.xml": build_description(header.identifier, header.sources)}
        return parts if terminals is None else {**parts, TERMINALS: terminals}


def find_version(name: str) -> FmiVersion:
    """Return the version called `2.0` or `3.0`.

    Raises:
        FmuError: if there is no such version.
    """
    if name not in _VERSIONS:
        raise FmuError(f"FMI version {name!r} cannot be built; choose {' or '.join(_VERSIONS)}")
    return _VERSIONS[name]


_VERSIONS = {"2.0": FmiVersion(2), "3.0": FmiVersion(3)}
