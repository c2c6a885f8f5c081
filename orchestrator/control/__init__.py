"""Control with learned models."""
