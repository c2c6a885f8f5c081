"""System Structure and Parameterization (SSP) 1.0, and of 2.0 arrays and the number types of FMI 3: import and export."""

from orchestrator.cosim.ssp.document import write_ssp
from orchestrator.cosim.ssp.reading import read_ssp

__all__ = ["read_ssp", "write_ssp"]
