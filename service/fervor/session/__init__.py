"""The live session: what was said, what each body did, what to compute next. No clock, no socket, no event loop."""
