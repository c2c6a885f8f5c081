"""The emulated arm: its muscles as FMUs in the loop, what the model expects, and what is learned of the rest."""
