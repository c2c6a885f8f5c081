"""Saved states of FMUs, freed when nobody refers to them."""

from orchestrator.cosim.fmu.instance import Instance


class SavedState:
    """A state that an FMU keeps for us."""

    def __init__(self, instance: Instance) -> None:
        self._instance, self._time = instance, instance.time
        self._pointer = instance.save()

    def restore(self) -> None:
        """Set the FMU back to it."""
        self._instance.restore(self._pointer)
        self._instance.time = self._time

    def __del__(self) -> None:
        if hasattr(self, "_pointer"):
            self._instance.release(self._pointer)
