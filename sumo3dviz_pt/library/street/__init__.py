"""Street furniture, signs, signals and barriers."""
