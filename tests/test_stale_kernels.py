"""A compiled kernel goes when its file, or any that it is made of, has changed."""

import ast
from pathlib import Path

import pytest

import vergence
from vergence.stale_kernels import _listed, forget_stale_kernels

SOURCES = {
    "__init__.py": "",
    "low/__init__.py": "from vergence.low.chain import walk\n",
    "low/chain.py": "def walk(): ...\n",
    "low/apart.py": "def other(): ...\n",
    "high/__init__.py": "from vergence.high.law import tick\n",
    "high/law.py": "from vergence.low import (\n    walk,\n)\n\ndef tick(): ...\n",
    "high/goal.py": (
        "import json\nfrom vergence.low.apart import other\nfrom vergence.high import tick\n"
    ),
}


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package whose every file has a compiled kernel, as it was when last used."""
    package = tmp_path / "vergence"
    for name, text in SOURCES.items():
        path = package / name
        path.parent.mkdir(exist_ok=True, parents=True)
        path.write_text(text)
        kernel = path.parent / "__pycache__" / f"{path.stem}.walk-3.py311.nbi"
        kernel.parent.mkdir(exist_ok=True)
        kernel.write_text("code")
    assert forget_stale_kernels(package) == []
    return package


def kernels(package: Path) -> set[str]:
    return {f"{k.parent.parent.name}/{k.name.split('.')[0]}" for k in package.rglob("*.nbi")}


def test_what_has_not_changed_is_kept(package: Path) -> None:
    (package / "low/chain.py").write_text(SOURCES["low/chain.py"])  # written again, the same
    before = kernels(package)
    assert forget_stale_kernels(package) == []
    assert kernels(package) == before


def test_a_package_that_is_moved_keeps_its_kernels(package: Path, tmp_path: Path) -> None:
    (tmp_path / "moved").mkdir()
    moved = package.rename(tmp_path / "moved" / "vergence")
    before = kernels(moved)
    assert forget_stale_kernels(moved) == []
    assert kernels(moved) == before


def test_kernels_that_call_what_has_changed_go_with_it(package: Path) -> None:
    (package / "low/chain.py").write_text("def walk(): return 1\n")
    before = kernels(package)
    forget_stale_kernels(package)
    changed = {"low/chain", "low/__init__", "high/law", "high/__init__", "high/goal"}
    assert before - kernels(package) == changed
    assert forget_stale_kernels(package) == []


def test_what_calls_nothing_that_has_changed_is_kept(package: Path) -> None:
    (package / "low/apart.py").write_text("def other(): return 1\n")
    assert set(forget_stale_kernels(package)) == {
        package / "low/apart.py",
        package / "high/goal.py",
    }


def test_every_import_of_the_package_is_seen() -> None:
    for path in Path(vergence.__file__).parent.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        imports = [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom)]
        wanted = {
            (Path(*(node.module or "").split(".")), name.name)
            for node in imports
            for name in node.names
            if (node.module or "").startswith("vergence")
        }
        seen = {(place, name) for place, names in _listed(text, Path()) for name in names}
        assert wanted <= seen, path
