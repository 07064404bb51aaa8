"""The shape of the package: explicit names, imports that point one way, a light root."""

import ast
import importlib
import inspect
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from itertools import chain
from pathlib import Path

import pytest

import vergence

SOURCE = Path(vergence.__file__).parent
PROJECT = Path(__file__).parents[1]

# A room uses rooms above it, never below; the modules of the root are above all rooms.
ROOMS = (
    "geometry",
    "signals",
    "camera",
    "features",
    "robot",
    "vision",
    "estimation",
    "planning",
    "control",
    "cell",
    "runtime",
    "drivers",
    "simulation",
    "assembly",
    "experiments",
    "studies",
    "app",
)
ROOT_MODULES = [
    *sorted(path.stem for path in SOURCE.glob("*.py") if not path.stem.startswith("__")),
    *(f"kernels/{path.stem}" for path in sorted((SOURCE / "kernels").glob("*.py"))),
]
HEAVY = ("mujoco", "cv2", "matplotlib", "scipy", "pydantic", "mcap", "foxglove", "dask", "typer")


def module_name(path: Path) -> str:
    parts = path.relative_to(SOURCE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = sorted(SOURCE.rglob("*.py"))
PACKAGES = sorted({path.parent for path in MODULES})


@pytest.mark.parametrize("folder", PACKAGES, ids=lambda folder: folder.name)
def test_every_package_names_what_it_offers(folder: Path) -> None:
    assert (folder / "__init__.py").is_file()
    package = importlib.import_module(module_name(folder / "__init__.py"))
    public = {
        name
        for name, value in vars(package).items()
        if not name.startswith("_") and not inspect.ismodule(value) and name != "annotations"
    }
    offered = list(getattr(package, "__all__", []))
    assert len(offered) == len(set(offered))
    lazy = {name for name in offered if name not in vars(package) and hasattr(package, name)}
    assert set(offered) - lazy == public - {"TYPE_CHECKING"}


def test_the_package_says_that_it_is_typed() -> None:
    assert (SOURCE / "py.typed").is_file()


def test_importing_the_root_loads_no_heavy_library() -> None:
    program = f"import sys, vergence; print(*sorted(set(sys.modules) & set({HEAVY!r})))"
    search = f"import sys; sys.path.insert(0, {str(SOURCE.parent)!r}); {program}"
    loaded = subprocess.run(
        [sys.executable, "-c", search], check=True, capture_output=True, text=True
    )
    assert loaded.stdout.split() == []


def imported_names(path: Path) -> Iterator[tuple[int, str]]:
    """Line and absolute dotted name of everything a file imports, wherever in the file."""
    package = module_name(path).split(".")
    if path.name != "__init__.py":
        package = package[:-1]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = package[: len(package) - node.level + 1] if node.level else []
            origin = ".".join([*base, *([node.module] if node.module else [])])
            yield from ((node.lineno, f"{origin}.{alias.name}") for alias in node.names)


def level(name: str) -> int | None:
    """Where a dotted name stands in the list: 0 for the root modules, None outside vergence."""
    parts = name.split(".")
    if parts[0] != "vergence":
        return None
    if len(parts) == 1 or parts[1] in ("kernels", *ROOT_MODULES) or parts[1].startswith("__"):
        return 0
    assert parts[1] in ROOMS, f"{name}: no room of that name"
    return 1 + ROOMS.index(parts[1])


@pytest.mark.parametrize(
    "path", [path for path in MODULES if path.parent != SOURCE], ids=module_name
)
def test_imports_only_point_up_the_list_of_rooms(path: Path) -> None:
    own = level(module_name(path))
    assert own is not None
    wrong = [
        f"line {line}: {name}"
        for line, name in imported_names(path)
        if (above := level(name)) is not None and above > own
    ]
    assert wrong == []


# Where ground truth may be read: what makes it, what compares with it, and what records it.
TRUTHFUL = ("simulation", "experiments", "studies", "app", "runtime/recording", "runtime/results")


def test_ground_truth_is_read_only_where_runs_are_simulated_compared_or_reported() -> None:
    found = []
    for path in MODULES:
        place = path.relative_to(SOURCE).as_posix()
        if any(place.startswith(f"{room}/") for room in TRUTHFUL):
            continue
        names = {
            n.attr for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Attribute)
        }
        if told := names & {"truth", "first_frame"}:
            found.append(f"{place}: {', '.join(sorted(told))}")
    assert found == []


@pytest.mark.parametrize("name", ROOT_MODULES)
def test_the_root_modules_use_no_room(name: str) -> None:
    names = [imported for _, imported in imported_names(SOURCE / f"{name}.py")]
    assert [imported for imported in names if level(imported)] == []


def distribution(requirement: str) -> str:
    """The normalized name in a requirement such as `scipy-stubs>=1.17`."""
    name = requirement
    for mark in "<>=!~[; ":
        name = name.split(mark)[0]
    return name.lower().replace("_", "-")


def test_every_dependency_is_pinned_and_no_host_is_named() -> None:
    project = tomllib.loads((PROJECT / "pyproject.toml").read_text())["project"]
    extras = chain.from_iterable(project["optional-dependencies"].values())
    needed = {distribution(text) for text in [*project["dependencies"], *extras]}
    lines = (PROJECT / "constraints.txt").read_text().splitlines()
    pins = [line for line in lines if line and not line.startswith("#")]
    assert all("==" in pin and "/" not in pin for pin in pins)
    assert needed <= {distribution(pin) for pin in pins}
