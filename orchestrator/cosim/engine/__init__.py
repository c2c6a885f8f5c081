"""The inner loop in C, for systems whose components are all FMUs."""
