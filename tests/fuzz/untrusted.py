"""What is common to the tests of untrusted input: mutants of a good file, and how it may end.

A file for a further kind of input needs a good example of it, and

    @given(mutants(EXAMPLE))
    def test_a_mutant_ends_in_one_sentence(data: bytes) -> None:
        ends_well(lambda: read(data))
"""

from collections.abc import Callable
from typing import TypeVar

from hypothesis import strategies as st

from vergence.errors import VergenceError

T = TypeVar("T")

_PIECES = (
    b"",
    b"\0",
    b"\xff",
    b"\n",
    b"-",
    b"1e400",
    b"NaN",
    b"9" * 400,
    b"9" * 5000,
    b"[" * 2000,
    b"{" * 300,
    b'"',
    b"\xff\xff\xff\xff\xff\xff\xff\x7f",
    b"$\\bad{$",
)


@st.composite
def mutants(draw: st.DrawFn, good: bytes) -> bytes:
    """A good file with some bytes overwritten, cut out, doubled, put in, or cut off at the end."""
    data = bytearray(good)
    for _ in range(draw(st.integers(1, 8))):
        at = draw(st.integers(0, max(len(data) - 1, 0)))
        size = draw(st.integers(0, 40))
        match draw(st.sampled_from(("overwrite", "put in", "cut out", "double", "end", "bit"))):
            case "overwrite":
                data[at : at + size] = draw(st.binary(min_size=size, max_size=size))
            case "put in":
                data[at:at] = draw(st.sampled_from(_PIECES))
            case "cut out":
                del data[at : at + size]
            case "double":
                data[at:at] = data[at : at + size]
            case "end":
                del data[at + 1 :]
            case "bit" if at < len(data):
                data[at] ^= 1 << draw(st.integers(0, 7))
    return bytes(data)


def ends_well(use: Callable[[], T]) -> T | None:
    """Use an input; return what comes of it, None if it is refused in one short sentence."""
    try:
        return use()
    except VergenceError as error:
        text = str(error)
        assert text.isprintable(), text
        assert len(text) < 2000, text
        return None
