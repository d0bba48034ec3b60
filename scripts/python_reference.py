#!/usr/bin/env python3
"""Writes the Python package's reference from its stubs and modules: python_reference.py [--check] PAGE.

The package is not imported: ``__all__`` lists the public names, and docstrings describe them.
"""

import argparse
import ast
import re
import sys
import textwrap
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent.parent / "python/standoff"
# Modules in the order of the page.
MODULES = ["__init__", "law", "components", "gym", "pettingzoo/group_tracking_v0", "dask", "mcap", "errors"]
HEAD = """# Python reference

<!-- scripts/python_reference.py writes this page from the stubs. -->

Every public name of the Python package; [Python](python.md) explains how to use it.
All numbers are SI units, positions metres east (x) and north (y), angles radians anticlockwise from east.
"""
Definition = ast.ClassDef | ast.FunctionDef


def definitions(path: Path) -> dict[str, Definition]:
    tree = ast.parse(path.read_text())
    return {node.name: node for node in tree.body if isinstance(node, ast.ClassDef | ast.FunctionDef)}


def public(path: Path) -> list[str]:
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return list(ast.literal_eval(node.value))
    return []


def signature(node: ast.FunctionDef, name: str) -> str:
    """Formats a signature without types, which the stubs contain."""
    arguments = node.args
    positional = [*arguments.posonlyargs, *arguments.args]
    defaults = [None] * (len(positional) - len(arguments.defaults)) + list(arguments.defaults)
    shown = [_argument(argument.arg, default) for argument, default in zip(positional, defaults, strict=True)]
    shown = [argument for argument in shown if argument not in ("self", "cls")]
    if arguments.kwonlyargs:
        shown.append("*")
        keyed = zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True)
        shown += [_argument(argument.arg, default) for argument, default in keyed]
    if arguments.kwarg:
        shown.append(f"**{arguments.kwarg.arg}")
    return f"{name}({', '.join(shown)})"


def _argument(name: str, default: ast.expr | None) -> str:
    return name if default is None else f"{name}={ast.unparse(default)}"


def prose(node: Definition) -> str:
    """Converts a docstring to Markdown."""
    text = ast.get_docstring(node) or ""
    text = re.sub(r":\w+:`~?\.?(?:standoff\.)?([^`]+)`", r"`\1`", text).replace("``", "`")
    lines: list[str] = []
    for line in text.splitlines():
        field = re.match(r":(?:param|cvar|ivar) (\w+): (.*)", line)
        other = re.match(r":(returns|raises)( \w+)?: (.*)", line)
        if field:
            lines.append(f"- `{field[1]}`: {field[2]}")
        elif other:
            raised = f" `{other[2].strip()}`" if other[2] else ""
            lines.append(f"- {other[1]}{raised}: {other[3]}")
        else:
            lines.append(line)
    # Continuation lines of list items are indented by two spaces.
    text = "\n".join(lines)
    text = re.sub(r"\n {4}(?=\S)", "\n  ", text)
    return text.strip()


def section(name: str, node: Definition) -> str:
    if isinstance(node, ast.FunctionDef):
        return f"### {name}\n\n`{signature(node, name)}`\n\n{prose(node)}\n"
    methods = [method for method in node.body if isinstance(method, ast.FunctionDef)]
    constructors = [method for method in methods if method.name in ("__new__", "__init__")]
    page = f"### {name}\n\n"
    if constructors:
        page += f"`{signature(constructors[0], name)}`\n\n"
    page += prose(node) + "\n"
    items = []
    for method in methods:
        if method.name.startswith("_") or not ast.get_docstring(method):
            continue
        decorators = {ast.unparse(decorator) for decorator in method.decorator_list}
        is_property = "property" in decorators
        usage = f"`{method.name}`" if is_property else f"`{signature(method, method.name)}`"
        items.append(f"- {usage}: {textwrap.indent(prose(method), '  ').strip()}")
    return page + ("\n" + "\n".join(items) + "\n" if items else "")


def reference() -> str:
    native = definitions(PACKAGE / "_standoff.pyi")
    page, seen = HEAD, set()
    for module in MODULES:
        path = PACKAGE / f"{module}.py"
        own = definitions(path)
        names = [name for name in public(path) if name in own or (name in native and name not in seen)]
        # Names of submodules are documented in the sections of these modules.
        if module == "__init__":
            names = [name for name in names if name in native]
        if not names:
            continue
        title = "standoff" if module == "__init__" else "standoff." + module.replace("/", ".")
        page += f"\n## {title}\n"
        intro = ast.get_docstring(ast.parse(path.read_text())) or ""
        page += "\n" + re.sub(r":\w+:`~?\.?(?:standoff\.)?([^`]+)`", r"`\1`", intro.split("\n\n")[0]).replace("``", "`") + "\n"
        for name in names:
            seen.add(name)
            page += "\n" + section(name, own.get(name) or native[name])
    return page


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--check", action="store_true")
    parser.add_argument("page", type=Path)
    given = parser.parse_args()
    page = reference()
    if not given.check:
        given.page.write_text(page)
    elif given.page.read_text() != page:
        sys.exit(f"{given.page} is out of date: scripts/refresh_python writes it")


if __name__ == "__main__":
    main()
