"""Postures held on the bus by stimulation alone: the least activations of emulated muscles, and an integrator for what the model lacks."""
