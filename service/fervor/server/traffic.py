"""What went over the wire of a session, in plain numbers, so that counting costs a frame next to nothing."""

from dataclasses import dataclass, fields


@dataclass(slots=True)
class Traffic:
    """Counts of one session, or of all."""

    bytes_in: int = 0
    bytes_out: int = 0
    checkpoints: int = 0
    checkpoint_bytes: int = 0
    gaps: int = 0
    """Frames that came after a gap."""
    resumed: int = 0
    """Bodies that went on from a checkpoint."""
    superseded: int = 0
    """Messages that a newer one made useless before a slow reader took them."""

    def __add__(self, other: "Traffic") -> "Traffic":
        """The sum of both."""
        return Traffic(*(getattr(self, field.name) + getattr(other, field.name) for field in fields(self)))
