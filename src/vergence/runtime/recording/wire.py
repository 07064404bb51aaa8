"""The part of protobuf's wire format that is needed to read back images and events.

The viewers' message types are protobuf; only three fields of two of them are needed again, so this
replaces a protobuf library.
"""

from typing import TypeAlias

Fields: TypeAlias = dict[int, int | bytes]

_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_LONGEST_VARINT = 63  # bits before the last byte of a number
_FIXED_SIZES = {_FIXED64: 8, _FIXED32: 4}


def fields(message: bytes) -> Fields:
    """Split a message into its fields by number; of a repeated field the last one is returned.

    Raises:
        ValueError: if it is not a protobuf message.
    """
    out: Fields = {}
    at = 0
    while at < len(message):
        tag, at = _varint(message, at)
        number, kind = tag >> 3, tag & 7
        if kind == _VARINT:
            out[number], at = _varint(message, at)
            continue
        if kind == _BYTES:
            size, at = _varint(message, at)
        elif kind in _FIXED_SIZES:
            size = _FIXED_SIZES[kind]
        else:
            raise ValueError(f"not a protobuf message: wire type {kind} at byte {at}")
        out[number] = message[at : at + size]
        at += size
    return out


def bytes_of(message: Fields, number: int) -> bytes:
    """Return a field of bytes; protobuf omits empty ones."""
    value = message.get(number, b"")
    return value if isinstance(value, bytes) else b""


def text_of(message: Fields, number: int) -> str:
    """Return a field of text."""
    return bytes_of(message, number).decode(errors="replace")


def time_of(message: Fields, number: int) -> float:
    """Return a field that is a timestamp, s."""
    stamp = fields(bytes_of(message, number))
    return (_number(stamp, 1) * 1_000_000_000 + _number(stamp, 2)) / 1e9


def _number(message: Fields, number: int) -> int:
    value = message.get(number, 0)
    return value if isinstance(value, int) else 0


def _varint(message: bytes, at: int) -> tuple[int, int]:
    """Return the number that starts at a byte, and the position after it."""
    value = shift = 0
    while at < len(message):
        byte = message[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7
        if shift > _LONGEST_VARINT:
            raise ValueError("not a protobuf message: a number of more than 64 bits")
    raise ValueError("not a protobuf message: it ends within a number")
