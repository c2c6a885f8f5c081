"""The library of effects: cards, what each needs in a record, and cards of the user's own. Begin at `cards.py`."""
