"""Record a page of the gallery of real recordings: one run of `misfit discover`, kept as a small JSON without the measured curves.

Run from the repository's root: python -m docs.generator.record_recordings NAME MODEL DATA
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[1] / "assets" / "recordings"
_KEPT = ("verdict", "incomplete", "unexplained_share", "effects", "best", "witness", "held_out", "noise_floor", "laws")
_LONGEST_CLASS = 60


def main(name: str, model: str, data: str) -> None:
    """Diagnose, add what is named, and keep what the page shows."""
    program = Path(sys.executable).with_name("misfit")
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "diagnosis.json"
        arguments = [model, data, "--out", folder, "--json", str(result), "--workers", "1", "--no-laws", "--quiet"]
        subprocess.run([str(program), "discover", *arguments], check=True)
        document = json.loads(result.read_text())
        written = sorted(Path(folder).glob("*.mo"), key=lambda path: path.stat().st_mtime)
        class_text = written[-1].read_text() if written else ""
    file, _, _ = model.rpartition(":")
    kept = kept_of(document)
    kept |= {"model_name": model.rpartition("/")[2], "data_name": f"{Path(data).name}/"}
    kept |= {"model_text": Path(file).read_text() if file else "", "commit": _commit()}
    kept |= {"written": class_text if len(class_text.splitlines()) <= _LONGEST_CLASS else ""}
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / f"{name}.json").write_text(json.dumps(kept, indent=1) + "\n")


def kept_of(document: dict[str, Any]) -> dict[str, Any]:
    """A diagnosis without what was measured: errors, effects, and the missing force by bins of one coordinate."""
    kept = {key: document.get(key) for key in _KEPT}
    kept["where"] = {"force": document["where"]["force"]}
    kept["ranking"] = document["ranking"][:8]
    kept["tried"] = document["tried"][:8]
    kept["steps"] = [{"effects": step["effects"], "held_out": step["held_out"]} for step in document["steps"]]
    kept["seconds"] = round(document["seconds"], 1)
    return rounded(kept)  # type: ignore[no-any-return]


def rounded(value: Any) -> Any:
    """Numbers to six digits."""
    if isinstance(value, dict):
        return {key: rounded(part) for key, part in value.items()}
    if isinstance(value, list):
        return [rounded(part) for part in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def _commit() -> str:
    found = subprocess.run(["git", "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=True)
    return found.stdout.strip()


if __name__ == "__main__":
    main(*sys.argv[1:4])
