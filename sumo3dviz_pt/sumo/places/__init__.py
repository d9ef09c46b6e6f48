"""Places that SUMO's files give in other ways than by net coordinates."""
