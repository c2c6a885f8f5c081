"""The C sources of a container."""
