"""A state saved in the middle of a run, and restored after it, leads to the same end."""

from collections.abc import Mapping
from typing import Any

from fmus.errors import ComponentError
from orchestrator.cosim.simulation import Simulation
from orchestrator.cosim.system import System
from orchestrator.regress.case import Case
from orchestrator.regress.comparison import Signal
from orchestrator.regress.outcome import WholeVerdict
from orchestrator.regress.recording import Wanted, wanted_signals
from orchestrator.regress.watched import Watched
from orchestrator.regress.whole.same import difference
from orchestrator.results.recorder import MemoryRecorder


def judge(case: Case, system: System, settings: Mapping[str, Any], progress: Watched) -> WholeVerdict:
    """Run to a share of the way, save, go on to the end, restore, go on again: both ways to the end are the same."""
    wanted, _ = wanted_signals(system)
    start, stop, step = system.run.start or 0.0, system.run.stop, system.run.step
    assert stop is not None and step is not None
    middle = start + step * max(1, round(settings["at"] * (stop - start) / step))
    progress.begin(system)
    with Simulation(system, record=wanted.recorded or None, progress=progress) as simulation:
        unable = [name for name, each in simulation.coupling.components.items() if not each.can_save]
        if unable:
            return WholeVerdict("save_restore", False, f"{', '.join(unable)} cannot save the state")
        simulation.run(middle)
        point = simulation.save()
        ways = [_onward(simulation, wanted, stop)]
        # Twice, since a state has to survive being restored.
        for _ in range(2):
            try:
                simulation.restore(point)
            except ComponentError as error:
                return WholeVerdict("save_restore", False, f"the state of {middle:.9g} s cannot be restored: {error}")
            ways.append(_onward(simulation, wanted, stop))
    for number, way in enumerate(ways[1:], 1):
        found = difference(ways[0], way, settings["within"])
        if found:
            words = f"after the state of {middle:.9g} s was restored ({number}x) the run differs: {found}"
            return WholeVerdict("save_restore", False, words)
    return WholeVerdict("save_restore", True, f"the state of {middle:.9g} s was restored twice, with the same end")


def _onward(simulation: Simulation, wanted: Wanted, stop: float) -> dict[str, Signal]:
    memory = MemoryRecorder()
    simulation.run(stop, memory)
    memory.finish()
    result = memory.result()
    return {
        name: Signal(name, result.time, result[address], result.column(address).unit)
        for name, address in wanted.addresses.items()
        if name not in wanted.inside
    }
