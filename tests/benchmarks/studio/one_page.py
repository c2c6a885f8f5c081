"""A server of one page with the views of one comparison: `python one_page.py FOLDER` prints its address first."""

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

    from orchestrator.studio.views import store
    from orchestrator.studio.views.page import comparison_views

    @ui.page("/", title="Views")
    def show() -> None:
        with ui.element("main").style("width: 100%"):
            ui.html("<h1>Views</h1>", sanitize=False)
            comparison_views(store.read(folder))

    app = FastAPI()
    ui.run_with(app, language="en-US", tailwind=False, show_welcome_message=False)
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    listener.listen()
    print(f"http://127.0.0.1:{listener.getsockname()[1]}/", flush=True)
    uvicorn.Server(uvicorn.Config(app, log_level="warning")).run(sockets=[listener])


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
