"""The engine: everything that is arithmetic on joints, and the model, over the batch of all bodies that wait."""
