"""What grows where a scenario has no plants."""
