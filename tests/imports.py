"""Imports between files, in Python and in Rust, and circular ones."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

ROOT = Path(__file__).resolve().parents[1]
PYTHON = ROOT / "python" / "divespot"
RUST = ROOT / "rust" / "divespot-core" / "src"

Graph = dict[str, set[str]]


def python_imports() -> Graph:
    """Return the modules of the package, each with those it imports, for its types alone too."""
    files = {_python_name(path): path for path in PYTHON.rglob("*.py")}
    known = {*files, "divespot._native"}
    return {
        name: {module for module in _imported(path, known) if module != name}
        for name, path in files.items()
    }


def _python_name(path: Path) -> str:
    parts = ("divespot", *path.relative_to(PYTHON).with_suffix("").parts)
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _imported(path: Path, known: set[str]) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name in known)
        elif isinstance(node, ast.ImportFrom) and node.module in known:
            names = (f"{node.module}.{alias.name}" for alias in node.names)
            yield from (name if name in known else node.module for name in names)


def rust_imports() -> Graph:
    """Return the core's modules, each with those it uses; tests are left out.

    A name that a module re-exports (``pub use``) counts for the module that defines it.
    """
    sources = {
        _rust_name(path): _without_tests(path.read_text())
        for path in RUST.rglob("*.rs")
        if "tests" not in path.with_suffix("").parts
    }
    passed_on = {name: _passed_on(name, text, sources) for name, text in sources.items()}
    graph: Graph = {}
    for name, text in sources.items():
        own = re.sub(r"pub(\([^)]*\))? use [^;]+;", "", text)
        paths = [path for path, _ in _uses(name, own, sources)]
        inline = re.findall(r"\b\w+(?:::\w+)+", own)
        paths += filter(None, (_path(name, path.split("::"), sources) for path in inline))
        graph[name] = {_owner(path, sources, passed_on) for path in paths} - {name}
    return graph


def _rust_name(path: Path) -> str:
    parts = path.relative_to(RUST).with_suffix("").parts
    return "::".join(("crate", *(part for part in parts if part not in {"mod", "lib"})))


def _without_tests(text: str) -> str:
    return re.sub(r"//[^\n]*", "", text).split("#[cfg(test)]", maxsplit=1)[0]


def _passed_on(name: str, text: str, sources: Mapping[str, str]) -> dict[str, tuple[str, ...]]:
    public = "".join(re.findall(r"pub(?:\([^)]*\))? (use [^;]+;)", text))
    return {known_as: path for path, known_as in _uses(name, public, sources)}


def _uses(
    name: str, text: str, sources: Mapping[str, str]
) -> Iterator[tuple[tuple[str, ...], str]]:
    """Return the full path and the local name of everything in ``use`` lines."""
    for line in re.findall(r"\buse ([^;]+);", text):
        for path in _expanded(re.sub(r"\s+", " ", line)):
            parts, _, alias = path.partition(" as ")
            steps = parts.strip().split("::")
            full = _path(name, steps, sources)
            if full:
                yield full, alias or steps[-1]


def _path(name: str, steps: list[str], sources: Mapping[str, str]) -> tuple[str, ...] | None:
    """Return the full path of a name used in a module; None if it is not in the core."""
    here = tuple(name.split("::"))
    if steps[0] == "crate":
        return tuple(steps)
    if f"{name}::{steps[0]}" in sources:
        return (*here, *steps)
    if steps[0] not in {"super", "self"}:
        return None
    while steps and steps[0] in {"super", "self"}:
        here = here[:-1] if steps[0] == "super" else here
        steps = steps[1:]
    return (*here, *steps)


def _expanded(tree: str) -> Iterator[str]:
    """Return the paths that a tree with braces stands for."""
    head, brace, rest = tree.partition("{")
    if not brace:
        yield tree
        return
    depth, item = 0, ""
    for char in rest:
        depth += (char == "{") - (char == "}")
        if depth < 0 or (char == "," and depth == 0):
            if item.strip():
                yield from _expanded(head + item.strip().removeprefix("self"))
            item = ""
        else:
            item += char


def _owner(
    path: tuple[str, ...],
    sources: Mapping[str, str],
    passed_on: Mapping[str, Mapping[str, tuple[str, ...]]],
) -> str:
    """Return the module that defines what a path names."""
    depth = max(n for n in range(1, len(path) + 1) if "::".join(path[:n]) in sources)
    module, rest = "::".join(path[:depth]), path[depth:]
    origin = passed_on[module].get(rest[0]) if rest else None
    return _owner((*origin, *rest[1:]), sources, passed_on) if origin else module


def circles(graph: Graph) -> list[frozenset[str]]:
    """Return the sets of modules that import each other, directly or indirectly."""
    reach = {name: _reached(name, graph) for name in graph}
    found = {frozenset(b for b in reach[a] if a in reach.get(b, ())) for a in graph}
    return sorted((circle for circle in found if len(circle) > 1), key=sorted)


def _reached(name: str, graph: Graph) -> set[str]:
    seen: set[str] = set()
    ahead = [*graph[name]]
    while ahead:
        one = ahead.pop()
        if one not in seen:
            seen.add(one)
            ahead += graph.get(one, ())
    return seen
