"""What several test files of the factory share."""

import fcntl
from pathlib import Path

import pytest
from helpers_hybrid import HYBRID

from fmus.build import build_all, targets_of
from fmus.catalogue import built_in_models
from fmus.files import cache_folder


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    """All FMUs of the library, and a hybrid one; from the cache where they are in it.

    Of two test processes one builds, the other waits.
    """
    targets = targets_of([*built_in_models().values(), HYBRID], tmp_path_factory.mktemp("library"))
    with open(cache_folder("fmu") / ".tests-lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        build_all(targets, workers=1)
    return [target.path for target in targets]
