"""What the Modelica front end would accept and silently misread, refused with file and line."""

from fmus.frontend.lint.check import lint_class
from fmus.frontend.lint.unit_check import check_units

__all__ = ["check_units", "lint_class"]
