"""From Modelica source to the flat DAE of one class."""
