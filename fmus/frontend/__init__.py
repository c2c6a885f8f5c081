"""From Modelica source to the flat DAE of one class."""

from fmus.frontend.compile import compile_class

__all__ = ["compile_class"]
