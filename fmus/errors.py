"""What can go wrong, in words for the user: one line that names the thing, the value and what to do."""


class MisfitError(Exception):
    """Wrong input or usage; the message is one complete line for the user."""

    exit_code = 2


class ModelicaError(MisfitError):
    """A Modelica class could not be read, for example a syntax error or an unsupported construct."""


class FmuError(MisfitError):
    """An FMU is broken or does not fit, for example an archive without a model description."""


class ComponentError(MisfitError):
    """A component failed while running, for example an FMU that refused a step."""

    exit_code = 3
