"""Drives of CANopen's profile CiA 402 in cyclic synchronous torque mode."""
