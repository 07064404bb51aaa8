"""Which definitions compiled kernels are made of, read from the sources.

A kernel contains the kernels that it calls and the constants that it uses, whatever file they are
in, but nothing else of those files.
"""

import ast
from collections.abc import Iterable, Iterator
from functools import cached_property
from hashlib import blake2b
from pathlib import Path
from typing import NamedTuple

_DECORATOR = "njit"


class Definition(NamedTuple):
    """A name that a source defines at its top level."""

    source: str  # as the sources are named
    name: str


class Import(NamedTuple):
    """What a name stands for that a source imports from the package."""

    module: Path  # without suffix
    name: str  # in it; empty for the module itself


class _Statement:
    """A statement at the top level of a source."""

    def __init__(self, node: ast.stmt) -> None:
        self._node = node
        names = [node for node in ast.walk(node) if isinstance(node, ast.Name)]
        self.uses = {name.id for name in names}
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            self.defines = {node.name}
        else:  # one that stores nothing may change what it uses
            self.defines = {n.id for n in names if isinstance(n.ctx, ast.Store)} or self.uses

    @property
    def lines(self) -> slice:
        """Where it is written, its decorators with it."""
        decorators: list[ast.expr] = getattr(self._node, "decorator_list", [])
        first = min([self._node.lineno, *(decorator.lineno for decorator in decorators)])
        return slice(first - 1, self._node.end_lineno)


class _Source:
    """One source, read when it is first asked for."""

    def __init__(self, path: Path, package: Path) -> None:
        text = path.read_text(encoding="utf-8", errors="replace")
        self._lines, self._root, self._package = text.split("\n"), package.parent, package.name
        self._has_kernels = _DECORATOR in text

    @cached_property
    def _body(self) -> list[ast.stmt]:
        try:
            return list(_flat(ast.parse("\n".join(self._lines)).body))
        except SyntaxError:  # which whoever imports it is told
            return []

    @cached_property
    def imports(self) -> dict[str, Import]:
        """What it imports from the package, by the name it has there."""
        found = {}
        for node in self._body:
            if isinstance(node, ast.ImportFrom) and self._is_own(module := node.module or ""):
                place = self._root.joinpath(*module.split("."))
                for given in node.names:
                    found[given.asname or given.name] = Import(place, given.name)
            elif isinstance(node, ast.Import):
                for given in node.names:
                    if self._is_own(given.name):
                        place = self._root.joinpath(*given.name.split("."))
                        found[given.asname or self._package] = Import(place, "")
        return found

    def _is_own(self, module: str) -> bool:
        return module.split(".")[0] == self._package

    @cached_property
    def definitions(self) -> dict[str, list[_Statement]]:
        """The statements that define or change each name."""
        found: dict[str, list[_Statement]] = {}
        for node in self._body:
            if not isinstance(node, ast.Import | ast.ImportFrom):
                statement = _Statement(node)
                for name in statement.defines:
                    found.setdefault(name, []).append(statement)
        return found

    @property
    def kernels(self) -> Iterator[str]:
        """The definitions that are compiled, or that hold functions that are."""
        if self._has_kernels:
            for name, statements in self.definitions.items():
                if any(_DECORATOR in statement.uses for statement in statements):
                    yield name

    def written(self, name: str) -> str:
        """Return the definition of a name as it is written."""
        return "\n".join(
            line for each in self.definitions[name] for line in self._lines[each.lines]
        )


def _flat(body: Iterable[ast.stmt]) -> Iterator[ast.stmt]:
    """Yield statements, of a condition those of both cases."""
    for node in body:
        if isinstance(node, ast.If):
            yield from _flat(node.body)
            yield from _flat(node.orelse)
        else:
            yield node


class MadeFrom:
    """What the kernels of a package's sources are made of.

    Args:
        package: its folder.
        sources: their paths, relative to it.
    """

    def __init__(self, package: Path, sources: Iterable[str]) -> None:
        self._package = package
        self._names = {package / name: name for name in sources}
        self._read: dict[str, _Source] = {}

    def mark(self, source: str) -> str:
        """Return a mark that changes with any definition that a source's kernels are made of."""
        parts = [self._source(at.source).written(at.name) for at in sorted(self.reached(source))]
        return blake2b("\0".join(parts).encode(), digest_size=8).hexdigest() if parts else ""

    def reached(self, source: str) -> set[Definition]:
        """Return the definitions that a source's kernels are made of: their own, and others'."""
        left = [Definition(source, name) for name in self._source(source).kernels]
        reached = set(left)
        while left:
            at = left.pop()
            for statement in self._source(at.source).definitions[at.name]:
                for name in statement.uses:
                    fresh = set(self._named(at.source, name)) - reached
                    reached |= fresh
                    left += fresh
        return reached

    def _named(self, source: str, name: str) -> Iterator[Definition]:
        """Yield what a name means in a source: nothing for one that is from elsewhere."""
        own = self._source(source)
        if name in own.definitions:
            yield Definition(source, name)
        elif name in own.imports:
            place, imported = own.imports[name]
            module, below = self._file(place), self._file(place / imported)
            if imported and module is not None and self._has(module, imported):
                yield from self._named(module, imported)
            elif (whole := below if imported else module) is not None:
                for each in self._source(whole).definitions:
                    yield Definition(whole, each)

    def _has(self, source: str, name: str) -> bool:
        own = self._source(source)
        return name in own.definitions or name in own.imports

    def _file(self, place: Path) -> str | None:
        files = (place.with_suffix(".py"), place / "__init__.py")
        return next((self._names[file] for file in files if file in self._names), None)

    def _source(self, name: str) -> _Source:
        if name not in self._read:
            self._read[name] = _Source(self._package / name, self._package)
        return self._read[name]
