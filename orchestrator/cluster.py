"""A Dask cluster, for those who name one."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from fmus.errors import MisfitError

# A scheduler that has just been started may need so long.
ANSWER_S = 5.0


def client_of(address: str) -> Any:
    """Client of the Dask scheduler at an address; whoever asks closes it.

    Raises:
        MisfitError: if Dask is not installed or no scheduler answers at the address.
    """
    try:
        from distributed import Client
    except ImportError as error:
        raise MisfitError(
            "--scheduler needs Dask; install it with: pip install 'misfit-fmu[dask]', here and on the workers"
        ) from error
    try:
        return Client(address, timeout=ANSWER_S, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise MisfitError(
            f"no Dask scheduler answers at {address}; start one with `dask scheduler` and name it as tcp://HOST:8786"
        ) from error


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """The client as a context manager."""
    client = client_of(address)
    try:
        yield client
    finally:
        client.close()
