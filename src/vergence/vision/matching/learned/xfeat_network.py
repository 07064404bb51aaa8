"""The network of XFeat [Potje2024] for OpenCV, with the weights of another package."""

from collections.abc import Mapping

import numpy as np

from vergence.vision.matching.learned.onnx_file import OnnxGraph
from vergence.vision.matching.learned.torch_file import NumberArray

CELL_PX = 8  # side of the image square that a descriptor represents
SIDE_PX = 32  # an image's sides must be multiples of it
_NORM = 1e-5  # epsilon of the batch normalisation

# Layers of each block: stride and width of the kernel; the weights determine the channels.
_BLOCKS = {
    "block1": ((1, 3), (2, 3), (1, 3), (2, 3)),
    "block2": ((1, 3), (1, 3)),
    "block3": ((2, 3), (1, 3), (1, 1)),
    "block4": ((2, 3), (1, 3), (1, 3)),
    "block5": ((2, 3), (1, 3), (1, 3), (1, 1)),
    "block_fusion": ((1, 3), (1, 3)),
    "heatmap_head": ((1, 1), (1, 1)),
    "keypoint_head": ((1, 1), (1, 1), (1, 1)),
}


def xfeat_onnx(weights: Mapping[str, NumberArray], height: int, width: int) -> bytes:
    """Return the network for images of one size, as an ONNX file.

    Its input `image` is (1, 1, height, width), with mean 0 and deviation 1. Its outputs are
    `descriptors` (1, 64, height / 8, width / 8), `places` (1, 65, …), the logits of the 64 pixels
    of a cell and of no feature in it, and `reliability` (1, 1, …).
    """
    graph = OnnxGraph("image", (1, 1, height, width))
    build = _Layers(graph, weights)
    pooled = graph.node("AveragePool", ("image",), "pooled", kernel_shape=(4, 4), strides=(4, 4))
    skip = build.convolution("skip1.1", pooled)
    x1 = build.block("block1", "image")
    x3 = build.block("block3", build.block("block2", build.add(x1, skip)))
    x4 = build.block("block4", x3)
    x5 = build.block("block5", x4)
    pyramid = build.add(build.add(x3, build.enlarged(x4, 2)), build.enlarged(x5, 4))
    fused = build.convolution("block_fusion.2", build.block("block_fusion", pyramid), "descriptors")
    reliable = build.convolution("heatmap_head.2", build.block("heatmap_head", fused))
    graph.node("Sigmoid", (reliable,), "reliability")
    # The pixels of a cell as channels, row by row.
    apart = graph.constant("apart", np.eye(CELL_PX**2, dtype=np.float32).reshape(-1, 1, 8, 8))
    cells = graph.node(
        "Conv", ("image", apart), "cells", kernel_shape=(8, 8), strides=(8, 8), pads=(0, 0, 0, 0)
    )
    build.convolution("keypoint_head.3", build.block("keypoint_head", cells), "places")
    rows, columns = height // CELL_PX, width // CELL_PX
    channels = {"descriptors": 64, "places": CELL_PX**2 + 1, "reliability": 1}
    return graph.file({name: (1, many, rows, columns) for name, many in channels.items()})


class _Layers:
    """Layers with the names of the weights."""

    def __init__(self, graph: OnnxGraph, weights: Mapping[str, NumberArray]) -> None:
        self._graph, self._weights = graph, weights

    def block(self, name: str, given: str) -> str:
        """Return convolutions, each with its batch normalisation merged and a rectifier."""
        for number, (stride, width) in enumerate(_BLOCKS[name]):
            layer = f"{name}.{number}.layer"
            kernel = self._weights[f"{layer}.0.weight"]
            scale = 1.0 / np.sqrt(self._weights[f"{layer}.1.running_var"] + _NORM)
            offset = -self._weights[f"{layer}.1.running_mean"] * scale
            filtered = self._filtered(
                layer, given, kernel * scale[:, None, None, None], offset, stride, width
            )
            given = self._graph.node("Relu", (filtered,), f"{layer}.cut")
        return given

    def convolution(self, name: str, given: str, output: str = "") -> str:
        """Return a 1 × 1 convolution without rectifier."""
        kernel, offset = self._weights[f"{name}.weight"], self._weights[f"{name}.bias"]
        return self._filtered(name, given, kernel, offset, 1, 1, output)

    def add(self, one: str, other: str) -> str:
        """Return a sum."""
        return self._graph.node("Add", (one, other), f"{one}+{other}")

    def enlarged(self, given: str, times: int) -> str:
        """Return an image enlarged by linear interpolation."""
        scales = self._graph.constant(f"{given}.scales", np.array([1, 1, times, times], np.float32))
        return self._graph.node(
            "Resize",
            (given, "", scales),
            f"{given}.enlarged",
            mode="linear",
            coordinate_transformation_mode="half_pixel",
        )

    def _filtered(
        self,
        name: str,
        given: str,
        kernel: NumberArray,
        offset: NumberArray,
        stride: int,
        width: int,
        output: str = "",
    ) -> str:
        names = (
            given,
            self._graph.constant(f"{name}.kernel", kernel),
            self._graph.constant(f"{name}.offset", offset),
        )
        return self._graph.node(
            "Conv",
            names,
            output or f"{name}.filtered",
            kernel_shape=(width, width),
            strides=(stride, stride),
            pads=(width // 2,) * 4,
        )
