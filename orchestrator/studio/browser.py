"""Open the user's browser without showing the token to other users of the machine."""

import os
import tempfile
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def browser_opened(link: str, folder: Path) -> Iterator[None]:
    """Open a link by way of a file that only the user can read: a command line is seen by everybody in `ps`."""
    handle, name = tempfile.mkstemp(dir=folder, prefix="open-", suffix=".html")
    with os.fdopen(handle, "w") as stream:
        stream.write(f'<!doctype html><meta http-equiv="refresh" content="0; url={link}"><a href="{link}">Open</a>\n')
    webbrowser.open(Path(name).resolve().as_uri())
    try:
        yield
    finally:
        Path(name).unlink(missing_ok=True)
