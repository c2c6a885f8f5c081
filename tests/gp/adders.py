"""Functions for systems of the tests."""


def pull(force, torque, moment_arm):
    """A tendon force with a joint torque on top, as the force that makes this torque at the moment arm, N."""
    return force + torque / moment_arm
