"""A compiled kernel goes when its file, or any that it is made of, has changed."""

import json
import math
import runpy
from importlib import import_module
from inspect import getclosurevars
from pathlib import Path
from types import ModuleType

import pytest
from numba.core.dispatcher import Dispatcher

import vergence
from vergence.kernels.cache import kernel_cache, kernels_of
from vergence.kernels.made_from import Definition, MadeFrom
from vergence.kernels.stale import forget_stale_kernels

KERNEL = "from numba import njit\n\n\n@njit(cache=True)\ndef {name}(): return {value}\n"
SOURCES = {
    "__init__.py": "",
    "low/__init__.py": "from vergence.low.chain import walk\n",
    "low/chain.py": "SCALE = 2\n" + KERNEL.format(name="walk", value="SCALE"),
    "low/apart.py": KERNEL.format(name="other", value=1),
    "high/__init__.py": "from vergence.high.law import tick\n",
    "high/law.py": (
        "from vergence.low import (\n    walk as step,\n)\n"
        + KERNEL.format(name="tick", value="step()")
    ),
    "high/goal.py": (
        "import json\nfrom vergence.low import apart\nfrom vergence.high import tick\n"
        + KERNEL.format(name="reach", value="apart.other()")
        + "def told(): return json.dumps(tick())\n"
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


def change(path: Path, before: str, after: str) -> None:
    text = path.read_text()
    assert before in text
    path.write_text(text.replace(before, after))


def kernels(package: Path) -> set[str]:
    return {f"{k.parent.parent.name}/{k.name.split('.')[0]}" for k in package.rglob("*.nbi")}


def test_what_has_not_changed_is_kept(package: Path) -> None:
    (package / "low/chain.py").write_text(SOURCES["low/chain.py"])  # written again, the same
    (package / "high/goal.py").write_text(SOURCES["high/goal.py"] + "def more(): ...\n")
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
    change(package / "low/chain.py", "SCALE = 2", "SCALE = 3")
    before = kernels(package)
    forget_stale_kernels(package)
    assert before - kernels(package) == {"low/chain", "high/law"}
    assert forget_stale_kernels(package) == []


def test_kernels_that_name_what_has_changed_by_its_file_go_with_it(package: Path) -> None:
    change(package / "low/apart.py", "return 1", "return 2")
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
    change(package / "low/chain.py", "SCALE = 2", "SCALE = 3")
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


def test_of_every_kernel_all_is_seen_that_it_is_made_of() -> None:
    package = Path(vergence.__file__).parent
    sources = [str(path.relative_to(package)) for path in package.rglob("*.py")]
    made_from, seen = MadeFrom(package, sources), 0
    for source in sources:
        if "njit" not in (package / source).read_text(encoding="utf-8"):
            continue
        reached = made_from.reached(source)
        module = import_module("vergence." + source.removesuffix(".py").replace("/", "."))
        for kernel in vars(module).values():
            if isinstance(kernel, Dispatcher) and kernel.py_func.__module__ == module.__name__:
                seen += 1
                for name, value in getclosurevars(kernel.py_func).globals.items():
                    assert is_of(value, reached, name), (source, kernel, name)
    assert seen > 300


def is_of(value: object, reached: set[Definition], name: str) -> bool:
    """Whether a kernel's name is known, or stands for what is not of the package."""
    function = value.py_func if isinstance(value, Dispatcher) else value
    home = getattr(function, "__module__", "") or ""
    if vars(math).get(name) is value:
        return True
    if isinstance(value, ModuleType) or (home and not home.startswith("vergence")):
        return not str(getattr(value, "__name__", "")).startswith("vergence")
    return bool({name, getattr(function, "__name__", name)} & {at.name for at in reached})
