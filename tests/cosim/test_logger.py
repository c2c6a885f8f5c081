"""An FMU that passes its logger something that is no record of ours does not make it write there."""

import ctypes

from orchestrator.cosim.engine.native import native_library
from orchestrator.cosim.fmu.messages import Messages, shared_record


def test_logger_writes_to_records_in_use_only() -> None:
    library = native_library()
    assert library is not None
    log = library.misfit_log2
    ours, gone = Messages(), Messages()
    gone.close()

    for environment in (ours.environment, gone.environment, ctypes.c_void_p(2)):
        log(environment, b"fmu", 0, b"info", b"n = %d", 7)

    assert ours.last() == "n = 7"
    assert gone.last() == ""
    assert shared_record().message == b"n = 7"
