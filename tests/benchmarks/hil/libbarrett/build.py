"""Build Barrett's library from a copy of its source, with the client beside it and kernel CAN sockets put on a socketcand server."""

import os
import re
import shutil
import subprocess
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).parent
# What the library's own CMakeLists takes without a real-time kernel and without Python.
FOLDERS = ("bus", "cdlbt", "math", "products", "systems", "thread", ".")
LEFT_OUT = ("python.cpp", "can_socket-rtcan.cpp", "real_time_mutex_impl-xenomai.cpp")
FLAGS = ("-O1", "-w", "-fPIC", "-pthread", "-fcommon")
CXX = (*FLAGS, "-std=gnu++11", "-fpermissive")
# Today's compilers want the word; the library's are ten years older.
_HOLDERS = ("tuple_grouper.h", "tuple_splitter.h")
# What has to be installed, by a header of it, and its package in Debian; folders in CPATH are looked into first, as g++ does.
_NEEDED = {
    "libconfig.h++": "libconfig++-dev",
    "boost/thread.hpp": "libboost-thread-dev",
    "boost/system/error_code.hpp": "libboost-system-dev",
    "gsl/gsl_version.h": "libgsl-dev",
    "curses.h": "libncurses-dev",
}


class NotBuilt(Exception):
    """A compiler's complaint, or a part that is missing."""


def build(source: Path, eigen: Path, into: Path, workers: int = 2) -> Path:
    """Copy, mend and compile; returns the client. What is there already is not compiled again.

    Args:
        source: a checkout of libbarrett.
        eigen: the folder with Eigen 2 (that holds `Eigen/Core` of version 2).

    Raises:
        NotBuilt: with what is missing.
    """
    for path, words in ((source / "src/products/puck.cpp", "libbarrett's source"), (eigen / "Eigen/Array", "Eigen 2")):
        if not path.exists():
            raise NotBuilt(f"{path.parent.parent} is not {words}: {path} is missing")
    headers = {name: _header(name) for name in _NEEDED}
    if missing := [_NEEDED[name] for name, path in headers.items() if path is None]:
        raise NotBuilt(
            f"not installed: {', '.join(missing)}; what was unpacked into folders is found by CPATH and LIBRARY_PATH"
        )
    tree = into / "source"
    if not tree.exists():
        into.mkdir(parents=True, exist_ok=True)
        shutil.copytree(source, tree, ignore=shutil.ignore_patterns(".git"))
        _mend(tree, into)
    include = [f"-I{into}", f"-I{tree / 'include'}", f"-I{eigen}"]
    with ThreadPoolExecutor(workers) as pool:
        objects = list(pool.map(lambda path: _object(path, tree, into, include), _sources(tree)))
    client = into / "client"
    libraries = ["-lconfig++", "-lconfig", "-lgsl", "-lgslcblas", "-lboost_thread", "-lboost_system", "-lcurses"]
    _run(["g++", *CXX, *include, str(HERE / "client.cpp"), *map(str, objects), "-o", str(client), *libraries])
    _run(["gcc", *FLAGS, "-shared", str(HERE / "can_shim.c"), "-o", str(into / "can_shim.so"), "-ldl"])
    return client


def _header(name: str) -> Path | None:
    folders = [folder for folder in os.environ.get("CPATH", "").split(os.pathsep) if folder]
    return next((path for folder in (*folders, "/usr/include") if (path := Path(folder) / name).exists()), None)


def _mend(tree: Path, into: Path) -> None:
    """The two places where today's compilers and today's libconfig differ from those of the library's time."""
    for name in _HOLDERS:
        path = tree / "include/barrett/systems" / name
        path.write_text(re.sub(r"(\w+)\.get(Input|Output)<(\w+)>", r"\1.template get\2<\3>", path.read_text()))
    filled = (tree / "include/barrett/config.h.in").read_text().replace("@BARRETT_ETC_PATH@", str(tree / "config"))
    (tree / "include/barrett/config.h").write_text(filled)
    # The example's arm of three joints comes with the stops of one with four; these are a Proficio's.
    (tree / "config/calibration_data/wam3/zerocal.conf").write_text("home = ( -1.01, -0.96, 2.84 );\n")
    getter = "public: config_setting_t *getCSetting() const { return _setting; } private:\n"
    header = (_header("libconfig.h++") or Path()).read_text()
    (into / "libconfig.h++").write_text(re.sub(r"(\n\s*config_setting_t \*_setting;)", rf"\n{getter}\1", header))


def _sources(tree: Path) -> list[Path]:
    found = [
        path for folder in FOLDERS for path in (tree / "src" / folder).glob("*.c*") if path.suffix in (".c", ".cpp")
    ]
    return sorted(path for path in found if path.name not in LEFT_OUT)


def _object(path: Path, tree: Path, into: Path, include: list[str]) -> Path:
    target = into / (str(path.relative_to(tree)).replace(os.sep, "-") + ".o")
    if not target.exists():
        compiler = ["g++", *CXX] if path.suffix == ".cpp" else ["gcc", *FLAGS]
        _run([*compiler, *include, "-c", str(path), "-o", str(target)])
    return target


def _run(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        raise NotBuilt(f"{' '.join(command)}\n{done.stderr[-1500:]}")
