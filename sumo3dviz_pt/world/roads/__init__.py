"""Road surfaces, kerbs and rails."""
