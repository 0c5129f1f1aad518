"""What can go wrong while measuring."""

from fervor.errors import FervorError


class BenchError(FervorError):
    """Something can't be measured here."""

    code = "bench"
    exit_code = 69
