"""What a client is told of an error."""

from fervor.errors import EngineError, FrameError, Overloaded
from fervor.protocol.messages import Frame
from fervor.session.refusal import refusal


def test_an_error_names_what_it_knows():
    told = refusal(FrameError("bad", body="eve", seq=3))
    assert (told.code, told.message, told.body, told.seq, told.fatal) == ("bad_frame", "bad", "eve", 3, False)
    assert refusal(Overloaded("full", retry_after=5.0)).retry_after == 5.0


def test_one_that_a_frame_caused_names_the_frame_and_ends_nothing():
    told = refusal(Overloaded("full"), Frame(body="ann", seq=7))
    assert (told.body, told.seq, told.fatal) == ("ann", 7, False)
    assert refusal(EngineError("no"), Frame(seq=0)).body == "0"
