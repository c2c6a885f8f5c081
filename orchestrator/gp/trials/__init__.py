"""From measured trials to a block that is proven on trials it has not seen."""
