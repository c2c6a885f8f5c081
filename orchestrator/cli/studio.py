"""`misfit studio`."""

from contextlib import nullcontext, suppress
from pathlib import Path

import click


@click.command()
@click.option("--port", type=click.IntRange(0, 65535), default=8765, show_default=True, help="0 takes a free one.")
@click.option("--no-browser", is_flag=True, help="Only print the link.")
@click.option(
    "--workspace",
    metavar="DIR",
    envvar="MISFIT_STUDIO",
    type=click.Path(file_okay=False, path_type=Path),
    help="Where projects are kept; by default in your user data folder.",
)
def studio(port: int, no_browser: bool, workspace: Path | None) -> None:
    """Do the same work in a browser: compare, diagnose, add, and watch the error fall.

    The first line printed is the link with its one-time token; the server listens on 127.0.0.1 only.
    """
    import platformdirs

    from orchestrator.studio.browser import browser_opened
    from orchestrator.studio.gate import Keys
    from orchestrator.studio.server import HOST, listen, serve

    folder = workspace or Path(platformdirs.user_data_dir("misfit")) / "studio"
    folder.mkdir(parents=True, exist_ok=True)
    listener, keys = listen(port), Keys()
    link = f"http://{HOST}:{listener.getsockname()[1]}/?token={keys.token}"
    with suppress(KeyboardInterrupt):  # Ctrl-C is how a studio ends, at once from when its link can be read
        click.echo(link)
        with nullcontext() if no_browser else browser_opened(link, folder):
            serve(listener, keys, folder.resolve())
