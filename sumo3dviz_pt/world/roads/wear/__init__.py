"""What traffic and weather leave on roads."""
