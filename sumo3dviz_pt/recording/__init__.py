"""Runs SUMO, or follows somebody's run of it, and keeps what a film needs."""
