"""Whole recordings: the estimates a stream of the same frames would get, to the bit."""
