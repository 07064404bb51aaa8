"""An MJCF that somebody else wrote is bounded; an arm's meshes cost no more than the drawing."""

from pathlib import Path

import pytest
from test_urdf_shapes import CORNERS, FLAT, ascii_stl, binary_stl

from vergence.errors import InputError
from vergence.robot import Arm
from vergence.robot.model_files import read_model

ARM = """<mujoco><compiler meshdir="meshes"/>
<asset><mesh name="seen" file="{file}"/></asset>
<worldbody><body name="link"><joint name="j" range="-90 90"/><geom type="mesh" mesh="seen"/>
<body name="tip" pos="0.3 0 0"><joint name="k"/><geom size="0.01"/></body></body></worldbody>
</mujoco>"""


def model(folder: Path, text: str) -> Path:
    path = folder / "model.xml"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("file", "content", "shapes"),
    [
        ("seen.stl", binary_stl(CORNERS), 2),
        ("text.stl", ascii_stl(CORNERS), 2),
        ("flat.stl", binary_stl(FLAT), 2),
        ("broken.stl", b"nothing", 1),
        ("gone.stl", None, 1),
    ],
)
def test_an_arm_moves_without_its_meshes(tmp_path: Path, caplog, file, content, shapes) -> None:
    (tmp_path / "meshes").mkdir()
    if content is not None:
        (tmp_path / "meshes" / file).write_bytes(content)
    compiled = read_model(model(tmp_path, ARM.format(file=file)), "tip").compile()
    assert Arm.from_mujoco(compiled, "tip", kind="body").names == ("j", "k")
    assert compiled.ngeom == shapes
    assert len(caplog.records) == (shapes < 2)
    assert shapes == 2 or f"drawn without mesh {file}, which" in caplog.text


INCLUDE = '<mujoco><include file="{}"/></mujoco>'
TOO_MUCH = {
    '<worldbody><replicate count="100"><replicate count="200"><geom size="1"/></replicate>'
    "</replicate></worldbody>": "count of replicate: given 20000 copies; allowed: up to 10000",
    '<worldbody><composite type="cloth" count="300 300 1"/></worldbody>': "count of composite",
    '<asset><texture type="2d" builtin="flat" width="1000000" height="9"/></asset>': "width of tex",
    '<asset><hfield name="h" nrow="9" ncol="1e9" size="1 1 1 1"/></asset>': "ncol of hfield",
    '<asset><hfield name="h" nrow="x" ncol="9" size="1 1 1 1"/></asset>': "nrow of hfield: given x",
    '<asset><hfield name="h" nrow="1e999" ncol="9" size="1 1 1 1"/></asset>': "nrow of hfield",
    '<size memory="1P"/>': "memory of size: given 1P; allowed: up to 1G",
    "<worldbody>" + "<body>" * 300 + "</body>" * 300 + "</worldbody>": "256 levels",
    '<worldbody><body nonsense="1"/></worldbody>': "a model that MuJoCo reads",
    '<include file="gone.xml"/>': r"gone\.xml: given No such file",
}


@pytest.mark.parametrize("text", TOO_MUCH)
def test_what_few_words_make_large_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match=TOO_MUCH[text]):
        read_model(model(tmp_path, f"<mujoco>{text}</mujoco>"))


def test_a_file_that_includes_itself_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="a model that MuJoCo reads"):
        read_model(model(tmp_path, INCLUDE.format("model.xml")))


def test_what_an_included_file_asks_for_is_bounded_too(tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text(
        '<mujoco><worldbody><replicate count="20000"><geom size="1"/></replicate></worldbody>'
        "</mujoco>"
    )
    with pytest.raises(InputError, match=r"part\.xml: count of replicate"):
        read_model(model(tmp_path, INCLUDE.format("part.xml")))


@pytest.mark.parametrize("limits", ['range="30 30"', 'range="90 -90"'])
def test_a_joint_that_has_no_range_is_refused_by_name(tmp_path: Path, limits: str) -> None:
    text = ARM.replace('range="-90 90"', limits).replace(
        '<geom type="mesh" mesh="seen"/>', '<geom size="0.1"/>'
    )
    text = text.replace('<asset><mesh name="seen" file="{file}"/></asset>', "")
    compiled = read_model(model(tmp_path, text), "tip").compile()
    with pytest.raises(InputError, match=r"range of j: .*lower below upper"):
        Arm.from_mujoco(compiled, "tip", kind="body")
