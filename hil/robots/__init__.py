"""Robots that sessions know: their transmission, kinematics and limits."""
