"""From a scene file to pictures: the only place that knows all stages."""
