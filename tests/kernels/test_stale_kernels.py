"""A compiled kernel goes when its file, or any that it is made of, has changed."""

import ast
import json
import runpy
from pathlib import Path

import pytest

import vergence
from vergence.kernels.cache import kernel_cache, kernels_of
from vergence.kernels.stale import _listed, forget_stale_kernels

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


@pytest.mark.parametrize("chosen", [True, False])
def test_kernels_that_are_kept_elsewhere_go_too(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, chosen: bool
) -> None:
    elsewhere = tmp_path / "elsewhere"
    if chosen:
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(elsewhere))
    else:  # the package cannot be written to
        monkeypatch.setenv("XDG_CACHE_HOME", str(elsewhere))
        monkeypatch.setattr("vergence.kernels.cache.os.access", lambda *_: False)
    kernel = kernel_cache(package / "high") / "law.tick-5.py311.nbi"
    assert elsewhere in kernel.parents
    kernel.parent.mkdir(parents=True)
    kernel.write_text("code")
    assert forget_stale_kernels(package) == []
    (package / "low/chain.py").write_text("def walk(): return 1\n")
    forget_stale_kernels(package)
    assert not kernel.exists()


def test_numba_keeps_kernels_where_they_are_looked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source = tmp_path / "kernel.py"
    source.write_text("from numba import njit\n\n@njit(cache=True)\ndef one(): return 1\n")
    for chosen in ("", str(tmp_path / "chosen")):
        monkeypatch.setattr("numba.config.CACHE_DIR", chosen)
        monkeypatch.setenv("NUMBA_CACHE_DIR", chosen)
        kernels = runpy.run_path(str(source))
        assert kernels["one"]() == 1
        assert len(list(kernels_of(source))) == 2


def test_of_a_wheel_only_its_own_kernels_stay(package: Path) -> None:
    own, other = "high/__pycache__/law.walk-3.py311.nbi", "low/__pycache__/chain.walk-3.py311.nbi"
    wheel = package / "kernels.json"
    wheel.write_text(json.dumps({"kernels": [own], "sources": "1"}))
    assert package / "low/chain.py" in forget_stale_kernels(package)
    assert kernels(package) == {"high/law"}
    (package / other).write_text("compiled here, with this wheel")
    assert forget_stale_kernels(package) == []
    assert kernels(package) == {"high/law", "low/chain"}
    wheel.write_text(json.dumps({"kernels": [own], "sources": "2"}))  # the next wheel
    assert forget_stale_kernels(package) == [package / "low/chain.py"]


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
