"""The error tree tells every edge what to do."""

from http import HTTPStatus

import fervor.errors as module
from fervor.errors import CloseCode, FervorError


def all_errors(root: type[FervorError] = FervorError) -> list[type[FervorError]]:
    return [root, *(leaf for child in root.__subclasses__() for leaf in all_errors(child))]


def test_every_error_carries_what_the_edges_need():
    for error in all_errors():
        assert error.code.isidentifier()
        assert HTTPStatus(error.http_status)
        assert error.close_code is None or CloseCode(error.close_code)
        assert 64 <= error.exit_code <= 78
        assert error.__doc__


def test_fatal_is_having_a_close_code():
    assert module.Overloaded("full", retry_after=2.0).fatal
    assert module.Overloaded("full", retry_after=2.0).retry_after == 2.0
    assert not module.MessageError("odd").fatal
    assert module.ProtocolError("odd").message == "odd"


def test_close_codes_are_those_of_the_design():
    assert sorted(CloseCode) == [1000, 1001, 1009, 1011, 1012, 1013, 4400, 4401, 4404, 4408, 4410, 4429]
