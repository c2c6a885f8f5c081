"""The worker's side: cases come, outcomes go; loaded libraries stay for the next case."""

import os

from orchestrator.cosim.isolate.child import Host
from orchestrator.cosim.kinds.code import told
from orchestrator.regress.execute import execute
from orchestrator.regress.recording import Watched

TASK = f"{__name__}:serve"


def serve(host: Host) -> None:
    """Run cases until the host closes the connection."""
    progress = Watched(host.memory.page, lambda labels: host.send("labels", labels))
    while True:
        case, want = host.receive()
        try:
            outcome = execute(case, progress, want)
        except MemoryError:
            host.send("error", "ComponentError", f"{case.name}: no memory is left")
            continue
        except Exception as error:  # a mistake here, or in a user's component: one line for the user all the same
            host.send("error", "ComponentError", f"{case.name}: {told(error)}")
            continue
        progress.leave()
        host.send("answer", outcome, resident_bytes())


def resident_bytes() -> int:
    """Memory that this process holds."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")
