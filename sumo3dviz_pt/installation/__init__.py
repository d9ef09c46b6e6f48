"""What this package stands on: pip's packages, shared libraries, and how they get here.

Nothing in here loads what may be missing, so that it can always be said what is.
"""
