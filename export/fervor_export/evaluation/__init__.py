"""How well intensities are estimated, measured so that a reviewer would believe it."""
