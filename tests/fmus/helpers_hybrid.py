"""A Modelica model with something of each kind."""

from pathlib import Path

from fmus.catalogue import ModelicaModel

# A start to be solved for, a root, stiffness, a delay, and events of state and time.
HYBRID = ModelicaModel("hybrid", "Hybrid", Path(__file__).parent / "exercise" / "Hybrid.mo", 1.0, 0.005)
