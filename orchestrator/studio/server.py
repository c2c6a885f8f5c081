"""The server: NiceGUI behind the gate, on 127.0.0.1 only."""

import os
import socket
from pathlib import Path

from fmus.errors import MisfitError
from orchestrator.studio.gate import Gate, Keys

HOST = "127.0.0.1"
# What a form adds to the file in it.
SLACK = 2**20


def listen(port: int) -> socket.socket:
    """A socket on 127.0.0.1; port 0 takes a free one.

    Raises:
        MisfitError: if the port is taken.
    """
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((HOST, port))
    except OSError as error:
        raise MisfitError(f"port {port} cannot be used ({error.strerror}); choose another with --port") from error
    listener.listen(128)
    return listener


def serve(listener: socket.socket, keys: Keys, folder: Path) -> None:
    """Serve until interrupted.

    Raises:
        KeyboardInterrupt: by Ctrl-C, once all work is cancelled.
    """
    os.environ["NICEGUI_STORAGE_PATH"] = str(folder / ".nicegui")
    import uvicorn
    from fastapi import FastAPI
    from nicegui import app as nicegui_app
    from nicegui import ui

    from orchestrator.studio import jobs, routes, workspace
    from orchestrator.studio.frame import mount
    from orchestrator.studio.pages import registered_pages
    from orchestrator.studio.receive import upload_limit

    workspace.use(folder)
    mount(registered_pages())
    routes.mount(workspace.current())
    app = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    ui.run_with(
        app,
        title="misfit studio",
        language="en-US",
        tailwind=False,
        show_welcome_message=False,
        gzip_middleware_factory=None,
    )
    # The bar that Quasar draws over the page during requests has no name that a screen reader could say.
    nicegui_app.config.quasar_config = {**nicegui_app.config.quasar_config, "loadingBar": {"skipHijack": True}}
    gate = Gate(app, listener.getsockname()[1], keys, most_bytes=upload_limit() + SLACK)
    config = uvicorn.Config(gate, log_level="warning", server_header=False, timeout_graceful_shutdown=1)
    try:
        uvicorn.Server(config).run(sockets=[listener])
    finally:
        jobs.cancel_all()
