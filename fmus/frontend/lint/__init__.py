"""What the Modelica front end would accept and silently misread, refused with file and line."""

from fmus.frontend.lint.check import lint_class

__all__ = ["lint_class"]
