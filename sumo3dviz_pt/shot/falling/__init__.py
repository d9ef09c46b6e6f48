"""What falls and flies before a shot's camera, for one frame after another."""
