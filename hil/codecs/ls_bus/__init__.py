"""CAN in the framing of the layered standard FMI-LS-BUS, as tools exchange it through binary variables of FMUs."""
