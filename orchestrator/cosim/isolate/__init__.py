"""Simulations and components in processes of their own: what an FMU breaks there is an error here."""
