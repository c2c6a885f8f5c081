"""FMUs whose equations are closed, diagnosed with effects attached to their inputs, outputs and force inputs."""
