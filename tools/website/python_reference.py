# SPDX-License-Identifier: BSD-3-Clause
"""The page of the Python API, from the stubs that are made when the package is built."""
import ast
import sys


def signature(node):
    text = ast.unparse(ast.FunctionDef(node.name, node.args, [ast.Expr(ast.Constant(...))], [], node.returns, lineno=0, type_params=[]))
    return text.splitlines()[0].removesuffix(':')


def shown(name):
    return not name.startswith('_') or name in ('__call__', '__init__')


def doc(node):
    text = ast.get_docstring(node) or ''
    out, block = [], False
    for line in text.splitlines():  # examples are code
        if line.startswith('>>>') and not block:
            out += ['', '```python']
            block = True
        if block and not line.strip():
            out.append('```')
            block = False
        out.append(line if block else line.replace('<', '&lt;').replace('*', r'\*'))
    return '\n'.join(out + (['```'] if block else []))


def entries(node):
    for item in node.body:
        if isinstance(item, ast.FunctionDef) and shown(item.name) and ast.get_docstring(item):
            is_property = any(ast.unparse(d).endswith('property') for d in item.decorator_list)
            kind = f'{item.name}: {ast.unparse(item.returns)}' if is_property and item.returns else signature(item)
            yield item.name, kind, doc(item)


def page(package):
    out = ['# Python', '', 'Every class and function of the package `dyntape`, from its stubs. [Use it from Python](../python.md) shows how they go together.', '']
    stubs = sorted(package.glob('*.pyi'))
    if not stubs:
        sys.exit(f'tools/site: there are no stubs in {package}; tools/build --python makes them')
    functions, classes = [], []
    for stub in stubs:
        for node in ast.parse(stub.read_text()).body:
            if isinstance(node, ast.FunctionDef) and shown(node.name) and ast.get_docstring(node):
                functions += [f'### `{node.name}`', '', '```python', signature(node), '```', '', doc(node), '']
            if isinstance(node, ast.ClassDef) and shown(node.name):
                classes += [f'## `{node.name}`', '', doc(node), '']
                for name, kind, text in entries(node):
                    classes += [f'### `{node.name}.{name}`', '', '```python', kind, '```', '', text, '']
    return '\n'.join([*out, '## Functions', '', *functions, *classes]) + '\n'
