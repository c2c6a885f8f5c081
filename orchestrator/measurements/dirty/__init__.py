"""Files as people have them: any separator, decimal sign, encoding, header and clock, with holes and stray lines."""
