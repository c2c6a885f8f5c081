"""A server of one page with the views of one comparison: `python one_page.py FOLDER` prints its address first.

The page stands in the studio's own frame, without its gate.
"""

import os
import socket
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("NICEGUI_STORAGE_PATH", tempfile.mkdtemp(prefix="one-page-"))


def serve(folder: Path) -> None:
    """Serve until killed."""
    import uvicorn
    from fastapi import FastAPI
    from nicegui import ui

    from orchestrator.studio.frame import mount
    from orchestrator.studio.pages import Page
    from orchestrator.studio.views import store
    from orchestrator.studio.views.page import comparison_views

    def build() -> None:
        ui.html("<h1>Views</h1><h2>One comparison</h2>", sanitize=False)
        comparison_views(store.read(folder))

    mount([Page("/", "Views", build, order=0)])
    app = FastAPI()
    ui.run_with(app, language="en-US", tailwind=False, show_welcome_message=False)
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    listener.listen()
    print(f"http://127.0.0.1:{listener.getsockname()[1]}/", flush=True)
    uvicorn.Server(uvicorn.Config(app, log_level="warning")).run(sockets=[listener])


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
