"""Trials from a protocol file: move, announce, stimulate, return."""
