"""Thin a diagnosis (`misfit diagnose --json`) to what the first screen reads, so that the browser's tests have answers of real runs.

Run from the repository's root: python -m tests.answers.keep NAME DIAGNOSIS.json
"""

import json
import sys
from pathlib import Path
from typing import Any

from docs.generator.record_recordings import rounded

FOLDER = Path(__file__).parent
POINTS = 200
UNREAD = ("kin", "excitation", "identifiability", "functions", "libraries", "mended", "data_checks", "model_file")


def thinned(document: dict[str, Any]) -> dict[str, Any]:
    """The document with numbers to six digits, curves of a few hundred points, and nothing that no screen shows."""
    kept = {key: value for key, value in document.items() if key not in UNREAD}
    kept["where"] = {"force": document["where"]["force"]}
    kept |= {key: document[key].rpartition("/")[2] for key in ("model", "data")}
    kept["curves"] = [_curve(curve) for curve in document["curves"]]
    return rounded(kept)  # type: ignore[no-any-return]


def _curve(curve: dict[str, Any]) -> dict[str, Any]:
    step = max(1, len(curve["time_s"]) // POINTS)
    signals = {
        name: {key: value[::step] if isinstance(value, list) else value for key, value in signal.items()}
        for name, signal in curve["signals"].items()
    }
    return {**curve, "time_s": curve["time_s"][::step], "signals": signals}


if __name__ == "__main__":
    found = json.loads(Path(sys.argv[2]).read_text())
    (FOLDER / f"{sys.argv[1]}.json").write_text(json.dumps(thinned(found), separators=(",", ":")) + "\n")
