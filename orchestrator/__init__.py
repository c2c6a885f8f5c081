"""Measurements, comparison, diagnosis, reports and the command line."""
