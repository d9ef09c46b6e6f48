"""Finds pairs of road users that pass a kerb one after the other, and proposes a study of them."""
