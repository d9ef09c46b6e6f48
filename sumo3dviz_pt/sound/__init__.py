"""Makes the sound of traffic: what sources send out, how it comes to a listener, what ears hear."""
