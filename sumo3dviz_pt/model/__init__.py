"""Values that cross stages: numpy and the standard library only."""
