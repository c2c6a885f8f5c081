"""A coupled system as one FMU: the components inside, coupled by the operations of misfit's own masters, in C."""

from orchestrator.cosim.container.package import build_container, container_of

__all__ = ["build_container", "container_of"]
