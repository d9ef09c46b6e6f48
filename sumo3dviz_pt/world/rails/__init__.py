"""Railways: tracks, level crossings and who guards what."""
