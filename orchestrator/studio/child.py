"""The process of a job: `python -m orchestrator.studio.child KIND [ARGUMENT]`, run in the project's folder."""

import json
import os
import sys
import time
import traceback
from pathlib import Path

from fmus.errors import MisfitError
from fmus.files import write_atomically
from orchestrator.studio.project import Project

FOLDER = Path("job")


def main() -> None:
    """Do a job and write down how it ended; errors are one line, as on the command line."""
    for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    from orchestrator.studio.tasks import TASKS

    begun = time.time()
    try:
        TASKS[sys.argv[1]](Project(Path.cwd()), _say, *sys.argv[2:])
        state, message = "done", ""
    except MisfitError as error:
        state, message = "failed", str(error)
    except Exception as error:  # a mistake in this program: one line for the user, the rest in the job's log
        traceback.print_exc()
        state, message = "failed", f"internal error: {type(error).__name__}: {error}"
    # Who dropped a file in knows it by its name, not by where the studio keeps it.
    message = " ".join(message.replace(f"{Path.cwd() / 'measurements'}/", "").split())
    end = {"state": state, "message": message, "seconds": time.time() - begun}
    write_atomically(FOLDER / "end.json", json.dumps(end).encode())


def _say(message: str) -> None:
    with (FOLDER / "progress.txt").open("a") as stream:
        stream.write(f"{time.time():.3f} {' '.join(message.split())}\n")


if __name__ == "__main__":
    main()
