"""Mutant schemata of the package: numbers at the top of a module are asked for where used."""

from __future__ import annotations

import ast
from pathlib import Path

PACKAGE = Path("python/divespot")
#: What simulates and reproduces is no part of an answer.
NO_ANSWER = ("simulate", "reproduce", "evaluate")
ASKED = """
import os as _os
_READ = set()

def value(name, number):
    read, mutant = _os.environ.get("DIVESPOT_READ"), _os.environ.get("DIVESPOT_MUTANT", "")
    if read and (read, name) not in _READ:
        _READ.add((read, name))
        with open(read, "a") as file:
            file.write(name + "\\n")
    return changed(number, mutant[0] == "*") if mutant[1:] == name else number

def forget():
    from divespot import _native
    _READ.clear()
    _native.forget()

def changed(number, doubled):
    if isinstance(number, tuple):
        return tuple(changed(part, doubled) for part in number)
    if isinstance(number, int):
        return number * 2 if doubled else number - number // 2
    return number * 2.0 if doubled else number * 0.5
"""


def write(root: Path) -> list[str]:
    """Rewrite the copy at `root`; return the names of its constants: "lengths FINE"."""
    trees = {path: ast.parse(path.read_text()) for path in (root / PACKAGE).rglob("*.py")}
    modules = {module_of(path.relative_to(root / PACKAGE)): path for path in trees}
    own = {module: constants(trees[path]) for module, path in modules.items()}
    for module, path in modules.items():
        known = imported(trees[path], module, own)
        if known:
            tree = Asked(known).visit(trees[path])
            asks = ast.parse("from divespot._mutant import value as _value").body
            future = [
                isinstance(node, ast.ImportFrom) and node.module == "__future__"
                for node in tree.body
            ]
            tree.body[future.index(True) + 1 if True in future else 0 : 0] = asks
            path.write_text(ast.unparse(ast.fix_missing_locations(tree)))
    (root / PACKAGE / "_mutant.py").write_text(ASKED)
    return [
        f"{m} {name}" for m in sorted(own) if not m.startswith(NO_ANSWER) for name in sorted(own[m])
    ]


def module_of(path: Path) -> str:
    """Return "io.las" for io/las.py, "io" for its __init__."""
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def constants(tree: ast.Module) -> set[str]:
    """Return the names in capitals at the top of a module that are numbers."""
    found = set()
    for node in tree.body:
        target = node.targets[0] if isinstance(node, ast.Assign) else getattr(node, "target", None)
        names = target.elts if isinstance(target, ast.Tuple) else [target]
        if all(isinstance(n, ast.Name) and n.id.isupper() for n in names) and is_number(node.value):
            found |= {name.id for name in names}
    return found


def is_number(node: ast.AST | None) -> bool:
    """Whether an expression consists of numbers."""
    if isinstance(node, ast.Constant):
        return isinstance(node.value, (int, float)) and not isinstance(node.value, bool)
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Attribute) and getattr(node.func.value, "id", "") == "math"
    parts = {ast.UnaryOp: ["operand"], ast.BinOp: ["left", "right"]}.get(type(node))
    if isinstance(node, ast.Tuple):
        return bool(node.elts) and all(is_number(part) for part in node.elts)
    return parts is not None and all(is_number(getattr(node, part)) for part in parts)


def imported(tree: ast.Module, module: str, own: dict[str, set[str]]) -> dict[str, str]:
    """Return the constants that a module knows, "FINE" or "lengths.FINE", with their full names."""
    known = {name: f"{module} {name}" for name in own[module]}
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith("divespot"):
            continue
        source = node.module.removeprefix("divespot").removeprefix(".")
        for alias in node.names:
            name, inner = alias.asname or alias.name, f"{source}.{alias.name}".removeprefix(".")
            if alias.name in own.get(source, ()):
                known[name] = f"{source} {alias.name}"
            known |= {f"{name}.{each}": f"{inner} {each}" for each in own.get(inner, ())}
    return known


class Asked(ast.NodeTransformer):
    """Asks for a constant's value wherever it is read."""

    def __init__(self, known: dict[str, str]) -> None:
        self.known = known

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """Ask for a constant."""
        return self._asked(node, node.id)

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """Ask for a constant of another module."""
        node = self.generic_visit(node)
        return self._asked(node, f"{getattr(node.value, 'id', '')}.{node.attr}")

    def visit_MatchValue(self, node: ast.MatchValue) -> ast.AST:
        """Leave a pattern as it is."""
        return node

    def _asked(self, node: ast.expr, name: str) -> ast.AST:
        if name not in self.known or not isinstance(node.ctx, ast.Load):
            return node
        return ast.Call(ast.Name("_value", ast.Load()), [ast.Constant(self.known[name]), node], [])
