"""Which code a result comes from, so that results of different code are never mixed."""

import hashlib
from pathlib import Path

ROOT = Path(__file__).parents[3]
FOLDERS = ("orchestrator", "fmus", "modelica", "tests/benchmarks/diagnosis/truth")
FILES = ("tests/benchmarks/diagnosis/suite.py",)
KINDS = {".py", ".toml", ".mo", ".c", ".h"}


def code_version() -> str:
    """Twelve hex digits of all code that cases and diagnoses come from."""
    content = hashlib.sha256()
    found = [file for folder in FOLDERS for file in sorted((ROOT / folder).rglob("*")) if file.suffix in KINDS]
    for file in [*found, *(ROOT / name for name in FILES)]:
        content.update(str(file.relative_to(ROOT)).encode() + file.read_bytes())
    return content.hexdigest()[:12]
