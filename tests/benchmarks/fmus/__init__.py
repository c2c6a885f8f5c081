"""The gate: every FMU and system structure of a folder, through everything that misfit does with one."""
