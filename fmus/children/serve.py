"""The child's side of a pool: calls what comes through the inherited pipe, until that is closed."""

import pickle
import sys
from multiprocessing.connection import Connection
from typing import Any


def main() -> None:
    """Serve calls that come through the inherited connection."""
    connection = Connection(int(sys.argv[1]))
    while True:
        try:
            content = connection.recv_bytes()
        except EOFError:
            return
        connection.send_bytes(_answer(content))


def _answer(content: bytes) -> bytes:
    try:
        function, arguments = pickle.loads(content)
        return pickle.dumps((True, function(*arguments)), pickle.HIGHEST_PROTOCOL)
    except Exception as error:
        return _failure(error)


def _failure(error: Exception) -> bytes:
    answer: tuple[bool, Any] = (False, error)
    try:
        content = pickle.dumps(answer, pickle.HIGHEST_PROTOCOL)
        pickle.loads(content)  # some exceptions can be written, and not read
    except Exception:
        return pickle.dumps((False, RuntimeError(f"{type(error).__name__}: {error}")))
    return content
