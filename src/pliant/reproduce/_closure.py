"""Which of the package's modules an experiment runs, read from its import statements: what its result depends on."""

from __future__ import annotations

import ast
from functools import cache
from importlib import resources
from pathlib import Path

PACKAGE = "pliant"


def closure(module: str) -> list[Path]:
    """Return the files that a module of the package imports, itself included, at any depth.

    A name taken from a package counts as the module that defines it: an experiment that draws a surface does not
    depend on the drawing of hearts.

    Parameters
    ----------
    module : str
        As ``"pliant.reproduce.table_2_1"``.

    Returns
    -------
    list of Path
        In order.

    Examples
    --------
    >>> [path.name for path in closure("pliant._arrays")]
    ['_arrays.py', 'errors.py']
    """
    seen: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in seen:
            seen.add(name)
            waiting += _imports(name)
    return sorted(path for path in map(_file, seen) if path is not None)


@cache
def _imports(module: str) -> tuple[str, ...]:
    path = _file(module)
    if path is None:
        return ()
    # A front page stands one level below its own name.
    here = f"{module}.__init__" if path.name == "__init__.py" else module
    found: list[str] = []
    for node in _guarded(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            source = _source(here, node)
            found += [_definer(source, alias.name) for alias in node.names]
    return tuple(name for name in found if name.split(".")[0] == PACKAGE)


def _guarded(tree: ast.AST) -> list[ast.AST]:
    """All nodes but those that only a type checker sees."""
    found: list[ast.AST] = []
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            continue
        found.append(node)
        waiting += ast.iter_child_nodes(node)
    return found


def _source(module: str, node: ast.ImportFrom) -> str:
    if not node.level:
        return node.module or ""
    base = module.split(".")[: -node.level]
    return ".".join([*base, *([node.module] if node.module else [])])


@cache
def _definer(source: str, name: str) -> str:
    """Return the module that a name comes from: a submodule, or what the front page of its package names."""
    if _file(f"{source}.{name}") is not None:
        return f"{source}.{name}"
    path = _file(source)
    if path is None or path.name != "__init__.py":
        return source
    for page in (path.with_suffix(".pyi"), path):
        if not page.is_file():
            continue
        for node in ast.walk(ast.parse(page.read_bytes())):
            if isinstance(node, ast.ImportFrom) and any((a.asname or a.name) == name for a in node.names):
                given = next(a.name for a in node.names if (a.asname or a.name) == name)
                return _definer(_source(f"{source}.__init__", node), given)
    return source


@cache
def _file(module: str) -> Path | None:
    parts = module.split(".")
    if parts[0] != PACKAGE:
        return None
    place = Path(str(resources.files(PACKAGE))).joinpath(*parts[1:])
    if (place / "__init__.py").is_file():
        return place / "__init__.py"
    alone = place.with_suffix(".py")
    return alone if alone.is_file() else None
