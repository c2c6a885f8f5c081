"""What other systems lack is imported where it is used, so that the packages import on Windows and macOS."""

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
POSIX_ONLY = {"fcntl", "resource", "termios", "tty", "pty", "pwd", "grp", "posix", "syslog", "crypt", "spwd"}
LINUX_ONLY = {"SIGKILL", "SIGBUS", "SIGHUP", "SIGUSR1", "SIGUSR2", "O_CLOEXEC", "memfd_create", "MFD_CLOEXEC", "poll"}
FILES = [file for room in ("fmus", "orchestrator", "hil") for file in (ROOT / room).rglob("*.py")]
FILES += [ROOT / f"{name}.py" for name in ("misfit", "misfit_start", "misfit_pytest")]


def at_import(node: ast.AST) -> Iterator[ast.AST]:
    """What is run when a module is imported: everything outside of functions."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            yield child
            yield from at_import(child)


def posix_only(tree: ast.AST) -> Iterator[str]:
    """Names of what Windows lacks, where importing needs them."""
    for node in at_import(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in POSIX_ONLY)
        elif isinstance(node, ast.ImportFrom) and node.module in POSIX_ONLY:
            yield str(node.module)
        elif isinstance(node, ast.Attribute) and node.attr in LINUX_ONLY and isinstance(node.value, ast.Name):
            yield f"{node.value.id}.{node.attr}"


def test_no_module_needs_posix_to_be_imported() -> None:
    found = [f"{file.relative_to(ROOT)}: {name}" for file in FILES for name in posix_only(ast.parse(file.read_text()))]
    assert found == []


@pytest.mark.parametrize(
    "text", ["import fcntl", "from termios import tcflush", "import signal\nX = {signal.SIGBUS: 1}"]
)
def test_the_check_sees_what_it_is_for(text: str) -> None:
    assert list(posix_only(ast.parse(text)))
    assert not list(posix_only(ast.parse(f"def f():\n    {text.splitlines()[0]}")))


def test_the_commands_are_imported_without_any_posix_module() -> None:
    """As on Windows: whoever asks for one of them fails."""
    code = (
        "import sys\n"
        "import subprocess, multiprocessing.connection, tempfile, click, numpy, asyncio, fmpy\n"
        f"for name in {sorted(POSIX_ONLY)!r}: sys.modules[name] = None\n"
        "import misfit, orchestrator.cli.main, orchestrator.cli.cosim, orchestrator.cli.sweep, orchestrator.cli.regress\n"
        "import orchestrator.cli.factory, orchestrator.cosim.run, orchestrator.regress.pool, hil.cli, fmus.build, fmus.validate\n"
        "import orchestrator.results.file_recorder, orchestrator.blackbox.process, orchestrator.ledger\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
