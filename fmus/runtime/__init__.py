"""The C runtime of generated FMUs, the generated part of it, and the compiler."""
