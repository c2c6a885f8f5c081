"""Checks that run an FMU's native code; each takes a `Subject` and yields findings, one line each."""
