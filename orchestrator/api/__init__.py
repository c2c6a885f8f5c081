"""The classes and functions behind `import misfit`: thin handles over the rooms, with one clear error for wrong arguments."""
