"""What a model lacks, written into the model as Modelica that a person would have written."""

from orchestrator.effects.changes import AddedState, Change, InputChange, OutputChange, Parameter, Term
from orchestrator.effects.write_back import write_back

__all__ = ["AddedState", "Change", "InputChange", "OutputChange", "Parameter", "Term", "write_back"]
