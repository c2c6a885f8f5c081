"""Everything that `misfit validate` finds about the FMUs of a case."""

from collections.abc import Mapping
from typing import Any

from fmus.validate import validate_fmu
from orchestrator.cosim.system import System
from orchestrator.regress.case import Case
from orchestrator.regress.outcome import WholeVerdict
from orchestrator.regress.watched import Watched


def judge(case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """Validate each FMU; findings that have one of the accepted texts in them do not count."""
    progress.leave()
    paths = [system.folder / spec.source for spec in system.components.values() if spec.kind == "fmu"]
    found = [(path, finding) for path in dict.fromkeys(paths) for finding in validate_fmu(path)]
    accepted = [finding for _, finding in found if any(text in finding for text in settings["accept"])]
    left = [f"{path.name}: {finding}" for path, finding in found if finding not in accepted]
    more = f" (and {len(left) - 1} more)" if len(left) > 1 else ""
    if left:
        return WholeVerdict("conformance", False, f"{left[0]}{more}", {"findings": left, "accepted": accepted})
    words = f"no findings in {len(set(paths))} FMU" + ("s" if len(set(paths)) > 1 else "")
    words += f", {len(accepted)} accepted" if accepted else ""
    return WholeVerdict("conformance", True, words, {"findings": [], "accepted": accepted})
