"""Record the picture of the start page: one run of `misfit discover`, kept as a small JSON with its provenance.

Run from the repository's root, about 40 s of processor time: python -m docs.generator.record_falling_error
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from orchestrator.ledger import FILE_NAME

MODEL, DATA = "arm", "tests/cases/arm/case_009"
TARGET = Path(__file__).parents[1] / "assets" / "falling_error.json"
_KEPT = ("name", "effects", "learning", "held_out", "noise_floor", "units", "data_hash", "date", "misfit_version")


def main() -> None:
    """Run the command in a folder of its own and keep what the picture shows."""
    command = ["misfit", "discover", MODEL, DATA]
    program = Path(sys.executable).with_name("misfit")
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([str(program), *command[1:], "--out", folder, "--quiet"], check=True)
        versions = [json.loads(line) for line in (Path(folder) / FILE_NAME).read_text().splitlines()]
    TARGET.write_text(json.dumps(document(" ".join(command), versions), indent=1) + "\n")


def document(command: str, versions: list[dict[str, Any]]) -> dict[str, Any]:
    """The recorded run: its command, the commit it was run at, and what the ledger says of each version."""
    commit = subprocess.run(["git", "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=True)
    return {
        "command": command,
        "commit": commit.stdout.strip(),
        "versions": [{key: version[key] for key in _KEPT} for version in versions],
    }


if __name__ == "__main__":
    main()
