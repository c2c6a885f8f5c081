"""Pan and zoom long records in a headless Chromium: `python tests/benchmarks/studio/curves.py [--trials 10] [--samples 1000000]`.

Prints gaps between frames, time and bytes of each refetch, and the memory of server and page.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from frames import HEADER, dragging, opened, resting, zooming

HERE = Path(__file__).parent
PAGE = HERE.parents[1] / "studio_views" / "one_page.py"


def memory(process: int) -> dict[str, float]:
    """Resident memory in MB: of its own, and of mapped files, which the system takes back when it needs it."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    values = dict(line.split(":", 1) for line in lines)
    return {name: int(values[name].split()[0]) / 1024 for name in ("RssAnon", "RssFile")}


def main() -> None:
    """Write the records, serve them, drive the browser, print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=10)
    parser.add_argument("--samples", type=int, default=1_000_000)
    parser.add_argument("--moves", type=int, default=240)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name) / "views"
        begun = time.perf_counter()
        subprocess.run([sys.executable, HERE / "records.py", folder, str(asked.trials), str(asked.samples)], check=True)
        disk = sum(file.stat().st_size for file in folder.iterdir()) / 1e6
        print(
            f"{asked.trials} trials x {asked.samples} samples, 2 signals: {disk:.0f} MB written in {time.perf_counter() - begun:.1f} s"
        )
        measure(folder, asked.moves)


def measure(folder: Path, moves: int) -> None:
    """Serve a folder and drive its page."""
    command = [sys.executable, str(PAGE), str(folder)]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)
    try:
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        before = memory(server.pid)
        with opened(address) as page:
            loaded = memory(server.pid)
            print(HEADER)
            print(resting(page).row())
            print(zooming(page, 5, inwards=True).row())
            print(dragging(page, moves).row())
            print(zooming(page, 40, inwards=True).row())
            print(dragging(page, moves).row())
            print(zooming(page, 40, inwards=False).row())
            heap = page.evaluate("performance.memory.usedJSHeapSize") / 1e6
        after = memory(server.pid)
        for what, found in (("started", before), ("page open", loaded), ("afterwards", after)):
            print(f"server {what}: {found['RssAnon']:.0f} MB of its own, {found['RssFile']:.0f} MB of mapped files")
        print(f"page: {heap:.0f} MB of JavaScript heap")
    finally:
        server.terminate()
        server.wait(timeout=20)


if __name__ == "__main__":
    main()
