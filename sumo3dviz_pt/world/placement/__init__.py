"""Where things may stand: lanes, heights, cameras to keep clear of."""
