"""What falls and flies is laid over finished pictures: rain, snow, splashes, spray, drops on glass.

Everything is a pure function of time and of the scene's seed, and lies in depth.
"""
