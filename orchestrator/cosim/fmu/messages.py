"""What an FMU says through its logger: the last messages are kept, for the error that may follow."""

import ctypes
from contextlib import suppress
from typing import Any

_LENGTH = 1024


class LogRecord(ctypes.Structure):
    """Mirror of `record` in logger.c; the FMU's environment points to it."""

    _fields_ = [
        ("count", ctypes.c_int64),
        ("status", ctypes.c_int32),
        ("category", ctypes.c_char * 60),
        ("message", ctypes.c_char * _LENGTH),
        ("next", ctypes.c_void_p),
    ]


class Messages:
    """The logger of one instance: two callbacks, and the record they write to."""

    def __init__(self) -> None:
        self.record = self._own = LogRecord()
        self._open = True
        _tell_c("misfit_use", self._own)

    @property
    def environment(self) -> ctypes.c_void_p:
        """What the callbacks get first."""
        return ctypes.c_void_p(ctypes.addressof(self.record))

    def last(self) -> str:
        """The last message, in one line."""
        return " ".join(self.record.message.decode("utf-8", "replace").split())

    def close(self) -> None:
        """Forget everything."""
        if self._open:
            self._open = False
            _tell_c("misfit_forget", self._own)

    def __del__(self) -> None:
        with suppress(ImportError, TypeError):  # when Python ends there is nobody left to tell
            self.close()


def _tell_c(function: str, record: LogRecord) -> None:
    """Tell the compiled logger which records there are: an FMU that passes it anything else must not make it write there."""
    from orchestrator.cosim.engine.native import native_library

    library = native_library()
    if library is not None:
        library[function](ctypes.byref(record))


# An FMU of version 1 passes its logger nothing that leads to a record of its own.
_shared = LogRecord()


def shared_record() -> LogRecord:
    """The record of all FMUs of version 1 in this process."""
    from orchestrator.cosim.engine.native import native_library

    library = native_library()
    return _shared if library is None else LogRecord.in_dll(library, "misfit_last1")


def _keep(environment: int | None, status: int, category: bytes | None, message: bytes | None) -> None:
    if not environment:
        return
    record = LogRecord.from_address(environment)
    record.status = status
    record.category = (category or b"")[:59]
    record.message = (message or b"")[: _LENGTH - 1]
    record.count += 1


# Without the compiled logger, which knows the variable arguments, a message comes as its format.
def _keep2(environment: int | None, _: bytes, status: int, category: bytes | None, message: bytes | None) -> None:
    _keep(environment, status, category, message)


def _keep1(_: int | None, __: bytes, status: int, category: bytes | None, message: bytes | None) -> None:
    _keep(ctypes.addressof(_shared), status, category, message)


_log1 = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)(_keep1)
_log2 = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)(_keep2)
_log3 = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p)(_keep)


def logger1() -> ctypes.c_void_p:
    """Address of the logger of FMI 1."""
    return _address("misfit_log1", _log1)


def logger2() -> ctypes.c_void_p:
    """Address of the logger of FMI 2."""
    return _address("misfit_log2", _log2)


def logger3() -> ctypes.c_void_p:
    """Address of the logger of FMI 3."""
    return _address("misfit_log3", _log3)


def _address(name: str, fallback: Any) -> ctypes.c_void_p:
    from orchestrator.cosim.engine.native import native_library

    library = native_library()
    return ctypes.cast(fallback if library is None else library[name], ctypes.c_void_p)
