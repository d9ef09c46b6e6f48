"""What grows where a scenario says nothing."""
