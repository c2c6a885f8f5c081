"""Binaries for other platforms: the right format and machine, and all functions of the standard exported."""

import importlib.util
import re
import struct
from pathlib import Path

import fmpy  # type: ignore[import-untyped]
import pytest
from helpers_binaries import exported
from helpers_systems import lag

from fmus import platforms
from fmus.archive import read_archive
from fmus.errors import FmuError
from fmus.package import build_fmu
from fmus.platforms import PLATFORMS, find_platforms, universal

needs_zig = pytest.mark.skipif(importlib.util.find_spec("ziglang") is None, reason="the wheel ziglang is not installed")

# Machine numbers of ELF (EM_X86_64, EM_AARCH64), PE (AMD64) and Mach-O (CPU_TYPE_X86_64, CPU_TYPE_ARM64).
MACHINES = {
    "x86_64-linux": "ELF 62",
    "aarch64-linux": "ELF 183",
    "x86_64-windows": "PE 0x8664",
    "x86_64-darwin": "Mach-O 0x1000007",
    "aarch64-darwin": "Mach-O 0x100000c",
}


def functions(fmi_version: str) -> set[str]:
    """Names of the functions that the header of a version declares."""
    header = Path(fmpy.__file__).parent / "c-code" / f"fmi{fmi_version[0]}Functions.h"
    return set(re.findall(rf"fmi{fmi_version[0]}(?!FunctionTypes)\w+(?=TYPE)", header.read_text()))


@needs_zig
def test_cross_built_libraries_have_their_platform_s_format_and_all_functions(tmp_path: Path) -> None:
    chosen = find_platforms("aarch64-linux,win64,darwin64,aarch64-darwin")
    files = read_archive(build_fmu(lag(), tmp_path / "lag.fmu", fmi_version="3.0", platforms=chosen))
    found = {name.split("/")[1]: exported(content) for name, content in files.items() if name.startswith("binaries/")}

    assert {name: machine for name, (machine, _) in found.items()} == MACHINES
    for name, (_, names) in found.items():
        assert functions("3.0") <= names, name
        assert not {n for n in names if n.startswith(("core_", "model_"))}, name


@needs_zig
def test_the_second_version_gets_its_own_folders_and_one_file_for_both_macs(tmp_path: Path) -> None:
    chosen = find_platforms("x86_64-windows,x86_64-darwin,aarch64-darwin")
    files = read_archive(build_fmu(lag(), tmp_path / "lag.fmu", platforms=chosen))
    binaries = {name: content for name, content in files.items() if name.startswith("binaries/")}

    assert set(binaries) == {
        "binaries/linux64/Test_Lag.so",
        "binaries/win64/Test_Lag.dll",
        "binaries/darwin64/Test_Lag.dylib",
    }
    both = binaries["binaries/darwin64/Test_Lag.dylib"]
    assert struct.unpack_from(">II", both) == (0xCAFEBABE, 2)
    for k, machine in enumerate(("Mach-O 0x1000007", "Mach-O 0x100000c")):
        offset, length = struct.unpack_from(">II", both, 8 + 20 * k + 8)
        kind, names = exported(both[offset : offset + length])
        assert kind == machine
        assert functions("2.0") <= names


@needs_zig
def test_equal_models_give_equal_bytes_on_all_platforms(tmp_path: Path) -> None:
    chosen = find_platforms("aarch64-linux,x86_64-windows,aarch64-darwin")
    one, two = (build_fmu(lag(), tmp_path / name, platforms=chosen).read_bytes() for name in ("1.fmu", "2.fmu"))
    assert one == two


def test_two_slices_of_a_universal_file_are_where_its_header_says() -> None:
    libraries = {PLATFORMS["x86_64-darwin"]: b"first", PLATFORMS["aarch64-darwin"]: b"second" * 5000}
    both = universal(libraries)
    assert [both[o : o + n] for o, n in (struct.unpack_from(">II", both, 16 + 20 * k) for k in (0, 1))] == list(
        libraries.values()
    )
    assert universal({PLATFORMS["x86_64-darwin"]: b"alone"}) == b"alone"


def test_without_zig_one_line_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platforms.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(FmuError, match=r"needs the Zig compiler; get it with: pip install 'misfit-fmu\[platforms\]'$"):
        find_platforms("win64")


def test_an_unknown_platform_is_named_with_those_there_are() -> None:
    with pytest.raises(FmuError, match="platform 'win32' is unknown; choose from x86_64-linux, .*aarch64-darwin"):
        find_platforms("linux64, win32")
