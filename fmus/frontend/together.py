"""Compile many Modelica classes in a few child processes: for a small class, starting one takes most of the time.

A child is called as `python -m fmus.frontend.together ROOT...`, with lines of JSON, `[MODEL, FILE, TARGET]`, as its input.
"""

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stdout, suppress
from pathlib import Path

from fmus.errors import ModelicaError
from fmus.frontend import worker
from fmus.frontend.compile import TIME_LIMIT_S, keep_dae, kept_dae
from fmus.frontend.lint import lint_class
from fmus.library import library_root


def compile_together(classes: Sequence[tuple[str, Path]], processes: int) -> None:
    """Put the flat DAEs of classes, each in a file of its own, where `compile_class` finds them.

    A class that cannot be compiled is left out; `compile_class` says why once it is needed.
    """
    missing = [pair for pair in dict.fromkeys(classes) if not kept_dae(*pair).is_file()]
    parts = [part for k in range(processes) if (part := missing[k::processes])]
    with ThreadPoolExecutor(max(len(parts), 1)) as pool:
        list(pool.map(_compile_part, parts))


def _compile_part(classes: Sequence[tuple[str, Path]]) -> None:
    """Compile classes in one child process, which writes each DAE when it is done: a crash loses the rest alone."""
    root = library_root()
    with tempfile.TemporaryDirectory() as folder:
        jobs = []
        for k, (model, file) in enumerate(classes):
            with suppress(ModelicaError):
                lint_class(model, file, [root])
                # The compiler reads all files beside the one it is given.
                alone = Path(folder) / str(k) / file.name
                alone.parent.mkdir()
                shutil.copyfile(file, alone)
                jobs.append((model, alone, alone.with_suffix(".json"), kept_dae(model, file)))
        lines = "".join(json.dumps([model, str(alone), str(done)]) + "\n" for model, alone, done, _ in jobs)
        command = [sys.executable, "-m", "fmus.frontend.together", str(root)]
        with suppress(subprocess.TimeoutExpired):
            subprocess.run(command, input=lines.encode(), capture_output=True, timeout=TIME_LIMIT_S, check=False)
        for *_, done, kept in jobs:
            if done.is_file():
                with suppress(ModelicaError):
                    keep_dae(kept, done.read_text())


def main() -> int:
    """Do what the worker does for each class of the input, and write its DAE to the target once it is whole."""
    roots = sys.argv[1:]
    for line in sys.stdin:
        model, file, target = json.loads(line)
        sys.argv[1:] = [model, file, *roots]
        unfinished = Path(f"{target}.part")
        with unfinished.open("w") as stream, redirect_stdout(stream):
            failed = worker.main()
        if not failed:
            unfinished.rename(target)
    return 0


if __name__ == "__main__":
    sys.exit(main())
