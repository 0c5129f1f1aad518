"""The command line: one file per command, each a function that knows its options and calls the floor below."""
