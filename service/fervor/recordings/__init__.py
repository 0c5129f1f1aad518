"""Recordings: motion files read into rotations with time stamps."""
