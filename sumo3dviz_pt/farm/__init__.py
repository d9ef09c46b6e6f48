"""Films and studies on many machines that share a folder: tasks, claims, workers, engines."""
