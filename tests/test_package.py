"""The package as a whole: what it exports, what importing it costs, what it must not contain."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import pliant

ROOT = Path(__file__).parents[1]
SOURCES = sorted((ROOT / "src" / "pliant").rglob("*.py"))
NAMES = [
    name for name in dir(pliant) if not name.startswith("_") and not inspect.ismodule(getattr(pliant, name))
]


def test_every_exported_name_is_there_and_described() -> None:
    missing = [name for name in NAMES if not (getattr(pliant, name).__doc__ or "").strip()]
    assert not missing


@pytest.mark.parametrize("name", [n for n in NAMES if inspect.isfunction(getattr(pliant, n))])
def test_public_functions_say_what_they_take_return_and_show(name: str) -> None:
    function = getattr(pliant, name)
    text = inspect.getdoc(function) or ""
    silent = inspect.signature(function).return_annotation in (None, "None")
    for section in ("Parameters", "Examples") if silent else ("Parameters", "Returns", "Examples"):
        assert re.search(rf"^{section}\n-+$", text, re.M), section


def test_rooms_export_what_the_package_does() -> None:
    stub = (ROOT / "src" / "pliant" / "__init__.pyi").read_text(encoding="utf-8")
    pairs = re.findall(r"^from \.([\w.]+) import (\w+) as", stub, re.M)
    assert len(pairs) > 40
    absent = [
        f"{room}.{name}"
        for room, name in pairs
        if name not in importlib.import_module(f"pliant.{room}").__all__
    ]
    assert not absent


def test_importing_the_package_imports_nothing_heavy() -> None:
    heavy = {"numpy", "scipy", "numba", "matplotlib", "sklearn", "nibabel", "cv2"}
    code = f"import pliant, sys; print(sorted({heavy!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: str(p.relative_to(ROOT / "src")))
def test_modules_stay_small_and_quiet(path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    tree = ast.parse(text)
    assert text.count("\n") <= 400, "more than 400 lines"
    for node in ast.walk(tree):
        assert not isinstance(node, ast.Assert), f"assert in line {node.lineno}"
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id != "print", f"print in line {node.lineno}"


def test_examples_in_the_documentation_name_things_that_exist() -> None:
    pages = [ROOT / "README.md", *(ROOT / "docs").glob("*.md")]
    used = {
        name
        for page in pages
        for name in re.findall(r"pliant\.([A-Za-z_]\w*)\(", page.read_text(encoding="utf-8"))
    }
    assert sorted(name for name in used if not hasattr(pliant, name)) == []
