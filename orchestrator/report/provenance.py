"""Where a report comes from: what was compared, when, and with which software."""

import platform
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib import metadata

from orchestrator.ledger import LedgerEntry

PACKAGES = ("casadi", "rumoca", "numpy", "scipy", "matplotlib")


def provenance(model: str, data: str) -> tuple[tuple[str, str], ...]:
    """Return name and value of each thing needed to repeat a result, made now."""
    versions = ", ".join(f"{name} {_version(name)}" for name in PACKAGES)
    return (
        ("model", model),
        ("data", data),
        ("misfit", _version("misfit-fmu")),
        ("Python", f"{platform.python_version()} on {platform.system()} {platform.machine()}"),
        ("packages", versions),
        ("report made", datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")),
    )


def ledger_provenance(entries: Sequence[LedgerEntry]) -> tuple[tuple[str, str], ...]:
    """Return the content hashes and dates that the ledger keeps for each version."""
    return tuple((f"version {entry.version}", _origin(entry)) for entry in entries)


def _origin(entry: LedgerEntry) -> str:
    made = f"{entry.model}, {entry.date}, misfit {entry.misfit_version}"
    return f"{made}, model sha256 {entry.model_hash}, data sha256 {entry.data_hash}"


def _version(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "not installed"
