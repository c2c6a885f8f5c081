"""Frames to numbers and back: pure functions, no bus and no clock."""
