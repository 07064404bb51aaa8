"""Writes networks in the ONNX format, a protocol buffer, as far as it is needed here."""

import struct
from collections.abc import Mapping, Sequence

import numpy as np

from vergence.vision.matching.learned.torch_file import NumberArray

Attribute = int | float | str | Sequence[int]

_OPERATORS = 13  # version of the operator set
_FLOAT, _INT64 = 1, 7  # types of elements
_KINDS = {"f": 1, "i": 2, "s": 3, "ints": 7}  # of attributes


class OnnxGraph:
    """A network, built node by node.

    Args:
        image: name of the input.
        shape: of the input, such as (1, 1, height, width).
    """

    def __init__(self, image: str, shape: Sequence[int]) -> None:
        self._input = _value(image, shape)
        self._nodes: list[bytes] = []
        self._constants: list[bytes] = []

    def constant(self, name: str, values: NumberArray) -> str:
        """Add constants, float32 or int64; return their name."""
        kind = _INT64 if values.dtype.kind == "i" else _FLOAT
        little = np.ascontiguousarray(values, "<i8" if kind == _INT64 else "<f4")
        dimensions = b"".join(_number(1, size) for size in values.shape)
        self._constants.append(
            dimensions + _number(2, kind) + _text(8, name) + _bytes(9, little.tobytes())
        )
        return name

    def node(
        self, operator: str, inputs: Sequence[str], output: str, **attributes: Attribute
    ) -> str:
        """Add an ONNX operator; return the name of its output."""
        message = b"".join(_text(1, name) for name in inputs) + _text(2, output)
        message += _text(3, output) + _text(4, operator)
        message += b"".join(_bytes(5, _attribute(key, value)) for key, value in attributes.items())
        self._nodes.append(message)
        return output

    def file(self, outputs: Mapping[str, Sequence[int]]) -> bytes:
        """Return the file.

        Args:
            outputs: names of the outputs, with shapes.
        """
        graph = b"".join(_bytes(1, node) for node in self._nodes) + _text(2, "network")
        graph += b"".join(_bytes(5, constant) for constant in self._constants)
        graph += _bytes(11, self._input)
        graph += b"".join(_bytes(12, _value(name, shape)) for name, shape in outputs.items())
        version = _text(1, "") + _number(2, _OPERATORS)
        return _number(1, 8) + _text(2, "vergence") + _bytes(7, graph) + _bytes(8, version)


def _attribute(name: str, value: Attribute) -> bytes:
    begin = _text(1, name)
    if isinstance(value, str):
        return begin + _text(4, value) + _number(20, _KINDS["s"])
    if isinstance(value, int):
        return begin + _number(3, value) + _number(20, _KINDS["i"])
    if isinstance(value, float):
        return begin + _tag(2, 5) + struct.pack("<f", value) + _number(20, _KINDS["f"])
    return begin + b"".join(_number(8, each) for each in value) + _number(20, _KINDS["ints"])


def _value(name: str, shape: Sequence[int]) -> bytes:
    sizes = b"".join(_bytes(1, _number(1, size)) for size in shape)
    return _text(1, name) + _bytes(2, _bytes(1, _number(1, _FLOAT) + _bytes(2, sizes)))


def _number(field: int, value: int) -> bytes:
    return _tag(field, 0) + _varint(value)


def _text(field: int, value: str) -> bytes:
    return _bytes(field, value.encode())


def _bytes(field: int, value: bytes) -> bytes:
    return _tag(field, 2) + _varint(len(value)) + value


def _tag(field: int, wire: int) -> bytes:
    return _varint(field << 3 | wire)


def _varint(value: int) -> bytes:
    """Return a number with seven bits per byte, the lowest first."""
    found = bytearray()
    while value > 0x7F:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    found.append(value)
    return bytes(found)
