"""Checks of a whole model, each found in the module that is named after it."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

from orchestrator.cosim.system import System
from orchestrator.regress.case import Case
from orchestrator.regress.outcome import WholeVerdict
from orchestrator.regress.watched import Watched


def judge_whole(name: str, case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """The verdict of a check on the system of a case.

    Raises:
        MisfitError: if it cannot be carried out.
        ComponentError: if a component fails on the way.
    """
    module = import_module(f"orchestrator.regress.whole.{name}")
    return module.judge(case, system, settings, progress)
