"""An evaluation of flat equations in plain numbers, apart from the translation that builds FMUs."""
