"""Compile many Modelica classes in a few child processes: for a small class, starting one takes most of the time.

A child is called as `python -m fmus.frontend.together`, with lines of JSON, `[MODEL, FILE]`, as its input, and leaves
flat DAE and symbolic form of each class in the cache.
"""

import io
import json
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import redirect_stdout, suppress
from pathlib import Path

from fmus.children import child_environment, python_command, run_child
from fmus.frontend import worker
from fmus.frontend.compile import TIME_LIMIT_S, check_names, keep_dae, kept_dae, laid_out

# No class takes so long, even on a busy machine.
USUAL_S = 20.0


def compile_together(classes: Sequence[tuple[str, Path]], processes: int) -> None:
    """Put classes, each in a file of its own, into the cache, where `ModelicaModel.compile` finds them.

    A class that cannot be compiled is left out, and so is what follows one that lets the compiler crash; whoever needs them
    compiles them alone, and is told why that fails.
    """
    parts = [part for k in range(processes) if (part := classes[k::processes])]
    with ThreadPoolExecutor(max(len(parts), 1)) as pool:
        list(pool.map(_run, parts))


def _run(classes: Sequence[tuple[str, Path]]) -> None:
    lines = "".join(json.dumps([model, str(file)]) + "\n" for model, file in classes)
    command = python_command("fmus.frontend.together")
    limit = TIME_LIMIT_S + USUAL_S * len(classes)
    with suppress(subprocess.TimeoutExpired):
        run_child(command, environment=child_environment(), given=lines.encode(), timeout_s=limit)


def main() -> int:
    """Compile each class of the input."""
    for line in sys.stdin:
        model, file = json.loads(line)
        with suppress(Exception):  # who needs the class compiles it alone and sees the message
            _compile(model, Path(file))
    return 0


def _compile(model: str, file: Path) -> None:
    from fmus.catalogue import ModelicaModel  # which compiles classes by this package

    kept = kept_dae(model, file)
    if not kept.is_file():
        check_names(model, file)
        with laid_out(model, file) as (source, roots), redirect_stdout(io.StringIO()) as text:
            sys.argv[1:] = [model, str(source), *map(str, roots)]
            if worker.main() != 0:
                return
        keep_dae(kept, text.getvalue())
    ModelicaModel(model, model, file).compile()


if __name__ == "__main__":
    sys.exit(main())
