"""The FMU factory: from Modelica source to symbolic models and FMUs."""
