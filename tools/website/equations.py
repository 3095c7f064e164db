# SPDX-License-Identifier: BSD-3-Clause
"""Displayed equations of a page, plain text in the repository, typeset in the site.

Indented lines are equations.  Two spaces separate the cells of a line; a number such as (D.7) ends or begins it.  A cell keeps its text and gets
the TeX of it as an attribute, which KaTeX, a part of the site, puts in place of the text.
"""
import html
import re

BLOCK = re.compile(r'(?:^ {4,}\S.*\n)+', re.MULTILINE)
SHOWN = """
<link rel="stylesheet" href="katex/katex.min.css">
<script src="katex/katex.min.js"></script>
<script>
for (const cell of document.querySelectorAll('td[data-tex]')) katex.render(cell.dataset.tex, cell, {strict: 'ignore'});
</script>
"""
NUMBER = re.compile(r'^\((\w\.\d+)\)\s+|\s*\((\w\.\d+)\)$')
GREEK = ('tau', 'mu', 'lambda', 'Lambda', 'delta', 'phi', 'nu', 'theta', 'Sigma')
NAMES = {'eps': r'\varepsilon', 'qd': r'\dot q', 'qdd': r'\ddot q', 'ddq': r'\ddot q', 'hd': r'\dot h', 'cd': r'\dot c', 'wd': r'\dot w', 'Ad': r'\dot A',
         'kp': 'k_p', 'kd': 'k_d', 'Jr': 'J_r', 'int': r'\int', 'sum': r'\sum', 'Σ_': r'\sum', **{name: '\\' + name for name in GREEK}}
FUNCTIONS = {'exp', 'log', 'det', 'tr', 'cot', 'tanh', 'max', 'diag', 'cond', 'cov', 'Rot', 'Trans', 'ID', 'FD', 'Im', 'null'}
WORDS_BELOW = {'ext', 'linear', 'root', 'min', 'world', 'tree', 'full'}
SIGNS = {'(+)': r'\oplus', '(-)': r'\ominus', '<-': r'\leftarrow', '->': r'\to', '=>': r'\Rightarrow', '<=': r'\le', '>=': r'\ge', '+=': r'\mathrel{+}=',
         '=:': r'\mathrel{=}:', '...': r'\ldots', 'x* ': r'\times^*', '<': r'\lt', '>': r'\gt', '×': r'\times', '·': r'\cdot', '−': '-', '⊕': r'\oplus',
         '⪰': r'\succeq', '⇔': r'\Leftrightarrow', '~': r'\sim', ' . ': r'\cdot', '=': '=', '+': '+', '-': '-', '/': '/', ',': ',', ';': ';', ':': ':',
         '(': '(', '[': '[', '⟨': r'\langle', '∫': r'\int', '||': r'\|'}
OPERANDS = {'½': r'\tfrac12', '…': r'\ldots', ')': ')', ']': ']', '⟩': r'\rangle', '|': '|', '*': '^*', '²': '^2', '⁻¹': '^{-1}', '⁻²': '^{-2}',
            '⁻ᵀ': '^{-T}', 'ᵀ': '^T'}
NAME = re.compile(r'Σ_|[A-Za-zα-ωΑ-Ω]+\d?')
ACCENT = re.compile(r'_(dd?ot|bar)(?![a-z])')
BELOW = re.compile(r'_(?:\{([^}]*)\}|\(([^)]*)\)|([A-Za-z0-9α-ω]+(?:,[A-Za-z0-9+-]+)*))')
ABOVE = re.compile(r'\^(?:\(([^)]*)\)|(-?\d+(?:/\d+)?|-T|[A-Za-z]+|[+*-]))')
MATRIX = re.compile(r'\[ ((?:[^\[\]]|\[[^\]]*\])*(?:;|  )(?:[^\[\]]|\[[^\]]*\])*) \]')


def differential(name):
    """d x of `dx`, d^2 x of `d2x`; None where the name is no differential."""
    match = re.fullmatch(r'd(2?)(\w+)', name)
    if match and (len(match.group(2)) == 1 or match.group(2) in NAMES or match.group(2) in ('ID', 'FD')):
        return ('d^2' if match.group(1) else 'd') + ' ' + (name_of(match.group(2)))
    return None


def name_of(name):
    if name in NAMES:
        return NAMES[name]
    if name in FUNCTIONS:
        return rf'\operatorname{{{name}}}'
    if match := re.fullmatch(r'([A-Za-z])(\d)', name):
        return f'{match.group(1)}_{match.group(2)}'
    return differential(name) or (rf'\mathrm{{{name}}}' if name.isupper() and len(name) > 1 else name)


def script(text):
    """What stands below or above a letter."""
    if not re.fullmatch(r'[\w,]+', text):
        return tex(text)
    text = re.sub('|'.join(GREEK), lambda greek: '\\' + greek.group(0) + ' ', text)
    return ','.join(rf'\text{{{word}}}' if word in WORDS_BELOW or (word.isupper() and len(word) > 2) else word for word in text.split(','))


def matrix(text):
    rows = (r' & '.join(tex(cell) for cell in re.split(r'  +', row.strip())) for row in text.split(';'))
    return r'\begin{bmatrix}' + r' \\ '.join(rows) + r'\end{bmatrix}'


class Scanner:
    """Reads one cell from left to right."""

    def __init__(self, text):
        self.text, self.at, self.out, self.is_operand = text, 0, [], False

    def put(self, piece, length, is_operand):
        self.out.append(piece)
        self.at += length
        self.is_operand = is_operand

    def is_cross(self):
        return self.is_operand and re.match(r' x [(\[\w]', self.text[self.at - 1:] if self.at else '')

    def name(self, match):
        name = match.group(0)
        end = self.at + len(name)
        accent = ACCENT.match(self.text, end)
        is_marked = self.text[end:end + 1] in ('_', '^', "'", '\u0302')
        is_word = len(name) > 1 and not is_marked and name_of(name) == name
        if self.text.startswith('\u0302', end):
            self.put(rf'\hat {name}', len(name) + 1, True)
        elif name == 'Ad' and self.text[end:end + 1] == '(':
            self.put(r'\operatorname{Ad}', len(name), True)
        elif accent:
            self.put(rf'\{accent.group(1)} {name}', accent.end() - self.at, True)
        elif self.text.startswith("'s ", end):  # of a thing
            self.put(rf"\text{{ {name}'s }}", len(name) + 2, False)
        elif name in ('op', 'beyond') or is_word:
            self.put(rf'\text{{ {name} }}', len(name), False)
        else:
            self.put(name_of(name), len(name), name not in ('int', 'sum', 'Σ_'))
            self.at -= name == 'Σ_'

    def script(self, mark, inside, length):
        if inside in ('dot', 'ddot'):  # of a letter that has something below it
            self.out[-2] = rf'\{inside} {self.out[-2]}'
            return self.put('', length, True)
        if mark == '_' and self.out[-1].startswith('_'):
            inside = self.out.pop()[2:-1] + ',' + script(inside)
            return self.put(f'_{{{inside}}}', length, True)
        is_second = mark == '^' and any(piece.startswith('^') for piece in self.out[-2:])
        return self.put(f'{"{}" * is_second}{mark}{{{script(inside)}}}', length, True)

    def step(self):
        text = self.text
        if self.is_cross():
            return self.put(r'\times', 1, False)
        if match := MATRIX.match(text, self.at):
            return self.put(matrix(match.group(1)), match.end() - self.at, True)
        if match := re.compile(r'\([A-Z]\.\d+\)').match(text, self.at):  # of another equation
            return self.put(rf'\text{{{match.group(0)}}}', match.end() - self.at, True)
        for sign, piece in SIGNS.items():
            if text.startswith(sign, self.at):
                return self.put(piece, len(sign), False)
        for pattern, mark in (BELOW, '_'), (ABOVE, '^'):
            if match := pattern.match(text, self.at):
                inside = next(group for group in match.groups() if group)
                return self.script(mark, inside, match.end() - self.at)
        if match := re.compile("'+").match(text, self.at):
            return self.put('^{' + r'\prime' * len(match.group(0)) + '}', match.end() - self.at, True)
        for sign, piece in OPERANDS.items():
            if text.startswith(sign, self.at):
                return self.put(piece, len(sign), True)
        if match := re.compile(r'\d+(?:\.\d+)?').match(text, self.at):
            return self.put(match.group(0), match.end() - self.at, True)
        if match := NAME.match(text, self.at):
            return self.name(match)
        if text[self.at] == ' ':
            self.at += 1
            return None
        if text[self.at] == '.':
            return self.put(r'\cdot' if text[self.at + 1:self.at + 2].strip() else '.', 1, False)
        raise ValueError(f'tools/website/equations.py: cannot typeset "{text[self.at:]}" of "{text}"')


def tex(text):
    """TeX of an equation in plain text."""
    scanner = Scanner(text)
    while scanner.at < len(text):
        scanner.step()
    whole = re.sub(r' \} \\text\{ ', ' ', ' '.join(scanner.out))  # words that follow each other
    return re.sub(r'^\\text\{ ', r'\\text{', whole)


def cells(line):
    """The parts of a line that two spaces separate outside of brackets, each with the column where it begins."""
    depth, begin, found = 0, None, []
    for column, character in enumerate(line + '  '):
        depth += (character in '([') - (character in ')]')
        if begin is None and character != ' ':
            begin = column
        elif begin is not None and depth <= 0 and line[column:column + 2].strip() == '' and character == ' ':
            found.append((begin, line[begin:column]))
            begin = None
    return [*found, (begin, line[begin:])] if begin is not None else found


def table(block):
    rows, columns = [], {}
    for line in block.rstrip('\n').split('\n'):
        match = NUMBER.search(line.strip())
        number = next((group for group in match.groups() if group), '') if match else ''
        if number:
            line = line.replace(f'({number})', ' ' * (len(number) + 2)).rstrip()
        rows.append((cells(line), number))
        for column, _ in rows[-1][0]:
            columns[column] = columns.get(column, 0) + 1
    first = min(columns)
    shared = sorted(column for column, count in columns.items() if count > 1 or column == first)
    out = ['<table class="equations">']
    for parts, number in rows:
        row = [[] for _ in shared]
        for column, text in parts:
            row[sum(other <= column for other in shared) - 1].append(text)
        name = f' id="{number}"' if number else ''
        out.append(f'<tr{name}>{"".join(map(cell, row))}<td class="number">{f"({number})" if number else ""}</td></tr>')
    return '\n'.join([*out, '</table>']) + '\n'


def cell(texts):
    if not texts:
        return '<td></td>'
    whole = r'\displaystyle ' + r' \qquad '.join(map(tex, texts))
    return f'<td data-tex="{html.escape(whole)}">{html.escape("   ".join(texts))}</td>'


def typeset(text):
    """The page with its equations as tables, and what shows them."""
    return BLOCK.sub(lambda match: table(match.group(0)), text) + SHOWN
