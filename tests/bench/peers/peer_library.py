# SPDX-License-Identifier: BSD-3-Clause
"""C that another generator printed, compiled as its users do: PATH.so, and PATH.json, which describes it.

    of = made_of('gcc', model_text, version)
    if not is_made(path, of, limit=600):
        make(path, [source], {'made_of': of, 'route': 'CasADi', 'symbol': 'f', 'generated_s': 0.1}, 'gcc', limit=600)
"""
import hashlib
import json
import subprocess
import time

FLAGS = ['-O3', '-march=native', '-DNDEBUG', '-fPIC', '-shared', '-w']


def made_of(compiler, *texts):
    """A hash of those texts, of the compiler and of its flags."""
    version = subprocess.run([compiler, '--version'], capture_output=True, text=True).stdout.splitlines()[0]
    return hashlib.sha256('\n'.join([*texts, version, *FLAGS]).encode()).hexdigest()


def beside(path, extension):
    return path.with_name(path.name + extension)


def is_made(path, of, limit):
    """Of the same texts, or known not to compile within that limit [s]."""
    report = beside(path, '.json')
    known = json.loads(report.read_text()) if report.exists() else {}
    return known.get('made_of') == of and ('absent' not in known or known['limit'] >= limit)


def make(path, sources, about, compiler, limit):
    """Compiles; what takes longer than `limit` [s] is described as absent."""
    library = beside(path, '.so')
    about = about | {'library': str(library.resolve()), 'flags': ' '.join([compiler, *FLAGS[:3]]), 'limit': limit}
    start = time.perf_counter()
    try:
        subprocess.run([compiler, *FLAGS, *map(str, sources), '-o', str(library), '-lm'], check=True, timeout=limit)
    except subprocess.TimeoutExpired:
        size = sum(source.stat().st_size for source in sources) / 1e6
        about['absent'] = f'its {size:.1f} MB of C do not compile within {limit:g} s'
    about['compile_s'] = time.perf_counter() - start
    about['made_s'] = about['generated_s'] + about['compile_s']
    beside(path, '.json').write_text(json.dumps(about, indent=1) + '\n')
