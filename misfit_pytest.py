"""The pytest plugin `orchestrator.regress.plugin`, found also where a user's folder has a file `orchestrator.py`."""

from misfit_start import import_our_packages

import_our_packages()

from orchestrator.regress.plugin import *  # noqa: E402, F403
