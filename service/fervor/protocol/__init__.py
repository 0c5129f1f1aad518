"""Wire protocol v1: messages, their encodings, and the poses inside them. No I/O."""
