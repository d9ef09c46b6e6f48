"""What this package stands on: pip's packages, shared libraries, and how to install them.

Nothing in here loads what may be missing, so that a missing part can always be named.
"""
