"""No test of this project is one that cannot fail."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parents[1]
#: Calls that fail by themselves, by a part of their name.
FAILING = ("assert", "check", "fail", "raises", "warns", "same", "validate", "expect")


def is_fixed(node: ast.expr) -> bool:
    """Whether an expression is always true, or always false."""
    if isinstance(node, ast.Tuple | ast.List | ast.Set):
        return bool(node.elts)
    fixed = (ast.Constant, ast.JoinedStr, ast.Lambda, ast.GeneratorExp)
    return isinstance(node, fixed) or (isinstance(node, ast.Dict) and bool(node.keys))


def holds_always(node: ast.expr) -> bool:
    """Whether a part of a condition does not depend on what is tested."""
    for part in ast.walk(node):
        if isinstance(part, ast.BoolOp) and any(map(is_fixed, part.values)):
            return True
        if isinstance(part, ast.Compare) and len(part.ops) == 1:
            left, right = ast.unparse(part.left), ast.unparse(part.comparators[0])
            counted = left.startswith("len(") and isinstance(part.ops[0], ast.GtE) and right == "0"
            if left == right or counted:
                return True
            if isinstance(part.left, ast.Constant) and isinstance(
                part.comparators[0], ast.Constant
            ):
                return True
    return is_fixed(node)


def is_there(node: ast.expr) -> bool:
    """Whether a condition only asks that something is not None."""
    return isinstance(node, ast.Compare) and isinstance(node.ops[0], ast.IsNot)


def faults(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Lines of assertions that cannot fail, and of tests without one that can."""
    helpers = {
        each.name
        for each in ast.walk(tree)
        if isinstance(each, ast.FunctionDef)
        and any(isinstance(part, ast.Assert) for part in ast.walk(each))
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Assert) and holds_always(node.test):
            yield node.lineno, f"holds always: {ast.unparse(node)[:80]}"
        if not isinstance(node, ast.FunctionDef) or not node.name.startswith("test_"):
            continue
        asked = [part.test for part in ast.walk(node) if isinstance(part, ast.Assert)]
        called = [ast.unparse(p.func) for p in ast.walk(node) if isinstance(p, ast.Call)]
        if any(name in helpers or any(f in name.lower() for f in FAILING) for name in called):
            continue
        if all(map(is_there, asked)):
            yield node.lineno, f"{node.name} asks for nothing but that something is there"


def test_no_assertion_of_the_tests_is_empty() -> None:
    found = [
        f"{path.relative_to(TESTS)}:{line}: {words}"
        for path in sorted(TESTS.rglob("*.py"))
        for line, words in faults(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert found == []


@pytest.mark.parametrize(
    "body",
    [
        'assert "edge" or "picture"',
        'assert made or "why"',
        "assert (made, 'why')",
        "assert len(made) >= 0",
        "assert made == made",
        "assert 1 == 1",
        "assert made is not None",
        "make(made)",
    ],
)
def test_empty_assertions_are_found(body: str) -> None:
    assert list(faults(ast.parse(f"def test_it(made):\n    {body}")))
    assert not list(faults(ast.parse(f"def test_it(made):\n    {body}\n    assert made == 3")))[1:]
