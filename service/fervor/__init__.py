"""fervor: live emotional intensity from body poses, for robots."""

from importlib.metadata import version

__version__: str = version("fervor")
