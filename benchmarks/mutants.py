"""Small mistakes made on purpose in Python code: one operator, number, condition or call at a time.

What is never changed: annotations, decorators, docstrings and other strings, the text of an error,
imports that only a type checker makes, and `zip`'s `strict`, which no right program meets.
"""

from __future__ import annotations

import ast
import copy
from collections.abc import Iterator
from dataclasses import dataclass

OPERATORS: dict[type, type] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.FloorDiv, ast.Pow: ast.Mult,
    ast.BitAnd: ast.BitOr, ast.BitOr: ast.BitAnd, ast.And: ast.Or, ast.Or: ast.And,
    ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
    ast.In: ast.NotIn, ast.NotIn: ast.In,
}  # fmt: skip
# Whole numbers are counted to or past a limit; two floating-point numbers are hardly ever equal.
BOUNDARIES: dict[type, type] = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt,
}  # fmt: skip
NEGATIONS: dict[type, type] = {
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt,
}  # fmt: skip
OPPOSITES = {
    a: b
    for pair in (("min", "max"), ("minimum", "maximum"), ("any", "all"), ("sin", "cos"),
                 ("argmin", "argmax"), ("floor", "ceil"))
    for a, b in (pair, pair[::-1])
}  # fmt: skip


@dataclass(frozen=True)
class Mutant:
    """Bytes `start` to `end` of a file replaced."""

    path: str
    line: int
    start: int
    end: int
    was: str
    becomes: str
    lines: frozenset[int]  # of the statement, or of what stands before its body

    @property
    def name(self) -> str:
        """What stands for it in a file of results, as long as its file is the same."""
        return f"{self.path}:{self.line}+{self.start}: {self.was} -> {self.becomes}"

    def is_one_of(self, listed: list[dict[str, str]], source: bytes) -> bool:
        """Whether it is listed by its file, the text of its line and the change, which outlive
        other changes of the file; of several alike in a line each is."""
        text = source.decode().splitlines()[self.line - 1].strip()
        mine = {"path": self.path, "statement": text, "was": self.was, "becomes": self.becomes}
        return any(mine.items() <= each.items() for each in listed)

    def applied(self, source: bytes) -> bytes:
        """The file with this mistake in it."""
        return source[: self.start] + self.becomes.encode() + source[self.end :]


def mutants_of(path: str, source: bytes) -> list[Mutant]:
    """All mutants of one file, in its order, each of which compiles."""
    lines = source.splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))
    found = []
    tree = ast.parse(source)
    heads = _lines_of_statements(tree)
    for node, becomes in _changes(tree):
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        start = starts[node.lineno - 1] + node.col_offset
        end = starts[node.end_lineno - 1] + node.end_col_offset
        was = source[start:end].decode()
        mutant = Mutant(path, node.lineno, start, end, was, becomes, heads[node.lineno])
        try:
            compile(mutant.applied(source), path, "exec")
        except SyntaxError:
            continue
        found.append(mutant)
    return found


def _lines_of_statements(tree: ast.AST) -> dict[int, frozenset[int]]:
    """For each line, those of the innermost statement on it; of an `if` or a `def`, its head's."""
    heads: dict[int, frozenset[int]] = {}
    for node in ast.walk(tree):  # outer ones first
        if isinstance(node, ast.stmt):
            assert node.end_lineno is not None
            body = getattr(node, "body", None) or getattr(node, "cases", None)
            last = max(node.lineno, body[0].lineno - 1) if body else node.end_lineno
            lines = frozenset(range(node.lineno, last + 1))
            heads.update(dict.fromkeys(range(node.lineno, node.end_lineno + 1), lines))
    return heads


def _changes(tree: ast.AST) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    """Nodes and the text to put in their place."""
    for node in _visited(tree):
        if isinstance(node, ast.stmt):
            if isinstance(node, ast.Raise) or (
                isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
            ):
                yield node, "pass"
            elif isinstance(node, ast.Continue):
                yield node, "break"
            elif isinstance(node, ast.If) and isinstance(
                node.test, (ast.Name, ast.Attribute, ast.Call)
            ):
                yield node.test, f"(not {ast.unparse(node.test)})"
            elif isinstance(node, ast.AugAssign) and type(node.op) in OPERATORS:
                yield node, ast.unparse(_with(node, op=OPERATORS[type(node.op)]()))
        elif isinstance(node, ast.expr):
            for changed in _changed(node):
                text = ast.unparse(changed)
                yield node, text if isinstance(changed, ast.Constant) else f"({text})"


def _changed(node: ast.expr) -> Iterator[ast.expr]:
    if isinstance(node, (ast.BinOp, ast.BoolOp)) and type(node.op) in OPERATORS:
        yield _with(node, op=OPERATORS[type(node.op)]())
    elif isinstance(node, ast.Compare) and len(node.ops) == 1:
        counted = any(_is_count(side) for side in (node.left, *node.comparators))
        kind = type(node.ops[0])
        table = OPERATORS | (BOUNDARIES if counted else NEGATIONS)
        yield _with(node, ops=[table[kind]()])
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.Not)):
        yield node.operand
    elif isinstance(node, ast.Constant) and isinstance(node.value, bool):
        yield ast.Constant(not node.value)
    elif isinstance(node, ast.Constant) and isinstance(node.value, (int, float)):
        larger = node.value + 1 if abs(node.value) < 100 else 2 * node.value
        yield ast.Constant(larger)
    elif isinstance(node, ast.IfExp):
        yield _with(node, test=ast.UnaryOp(ast.Not(), node.test))
    elif isinstance(node, ast.Attribute) and node.attr == "T":
        yield node.value
    elif isinstance(node, ast.Call):
        called = node.func
        if isinstance(called, ast.Name) and called.id in OPPOSITES:
            yield _with(node, func=ast.Name(OPPOSITES[called.id]))
        elif isinstance(called, ast.Attribute) and called.attr in OPPOSITES:
            yield _with(node, func=_with(called, attr=OPPOSITES[called.attr]))


def _is_count(node: ast.expr) -> bool:
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and node.func.id == "len"
    return isinstance(node, ast.Constant) and type(node.value) is int


def _with(node: ast.AST, **changes: object) -> ast.AST:
    changed = copy.copy(node)
    for name, value in changes.items():
        setattr(changed, name, value)
    return changed


def _visited(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes that may be changed, a parent before what is in it."""
    yield node
    if isinstance(node, (ast.JoinedStr, ast.Raise)):
        return
    if isinstance(node, ast.keyword) and node.arg == "strict":
        return
    if isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING"):
        return
    for field, value in ast.iter_fields(node):
        if field in ("annotation", "returns", "decorator_list"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _visited(child)
