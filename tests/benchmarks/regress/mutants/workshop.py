"""Mutants made into FMUs, from a copy of the Modelica library in which one line differs."""

import json
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from fmus.errors import MisfitError
from fmus.frontend.lint import check_units, lint_class
from fmus.library import library_root
from fmus.package import build_fmu
from fmus.runtime import compiler
from fmus.symbolic.build import build_system
from tests.benchmarks.regress.mutants.choose import OWN, Mutant, source_of
from tests.benchmarks.regress.mutants.subjects import Subject

TIME_LIMIT_S = 60.0


class Invalid(Exception):
    """A mutant that no FMU can be made of; the message says why."""


@dataclass(frozen=True)
class Workshop:
    """A folder with a copy of the library under `library` and the subjects' own classes under `own`."""

    folder: Path

    @classmethod
    def open(cls, folder: Path) -> "Workshop":
        """Copy the library into a folder, anew each time."""
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(library_root(), folder / "library", ignore=shutil.ignore_patterns("Test", "Examples"))
        (folder / "library/FESArm/package.order").write_text(
            "".join(
                f"{name}\n"
                for name in (library_root() / "FESArm/package.order").read_text().split()
                if name not in ("Test", "Examples")
            )
        )
        (folder / "own").mkdir()
        return cls(folder)

    def build(self, subject: Subject, target: Path, mutant: Mutant | None = None) -> None:
        """Write the FMU of a subject, with a mutant's change in it, to a file.

        Raises:
            Invalid: if it does not compile.
        """
        own = self.folder / "own" / f"{subject.name}.mo"
        own.write_text(subject.text)
        with self._changed(subject, own, mutant):
            try:
                dae = self._compiled(subject.name, own)
                system = build_system(dae, subject.name, "")
                build_fmu(system, target, stop_time=subject.stop_s, step_size=subject.step_s)
            except MisfitError as error:
                raise Invalid(str(error)) from error

    @contextmanager
    def _changed(self, subject: Subject, own: Path, mutant: Mutant | None) -> Iterator[None]:
        if mutant is None:
            yield
            return
        original = source_of(subject, mutant.file)
        changed = own if mutant.file == OWN else self.folder / "library/FESArm" / mutant.file
        changed.write_text(mutant.change.apply(original))
        try:
            yield
        finally:
            changed.write_text(original)

    def _compiled(self, model: str, file: Path) -> dict:
        root = self.folder / "library"
        lint_class(model, file, [root])
        command = [sys.executable, "-m", "fmus.frontend.worker", model, str(file), str(root)]
        try:
            done = subprocess.run(command, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False)
        except subprocess.TimeoutExpired:
            raise Invalid(f"compiling takes longer than {TIME_LIMIT_S:g} s") from None
        if done.returncode != 0:
            raise Invalid(done.stderr.strip().splitlines()[0] if done.stderr.strip() else "the compiler crashed")
        dae = json.loads(done.stdout)
        check_units(dae)
        return dae


@contextmanager
def compiler_flags(flags: Sequence[str]) -> Iterator[None]:
    """Let FMUs be compiled with other flags for optimisation."""
    usual = compiler.FLAGS
    compiler.FLAGS = tuple(flag for flag in usual if not flag.startswith("-O")) + tuple(flags)
    try:
        yield
    finally:
        compiler.FLAGS = usual
