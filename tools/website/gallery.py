# SPDX-License-Identifier: BSD-3-Clause
"""The gallery: every shipped task, controller, scene and sweep, run by the command line, with its picture, report and 3D page."""
import hashlib
import json
import pathlib
import re
import shutil
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
KINDS = [('tasks', 'Motions that are optimised', 'solve'), ('control', 'Controllers in closed loop', 'mpc'),
         ('scenes', 'Scenes that are simulated', 'simulate'), ('sweeps', 'Sweeps', 'sweep')]
PICTURES = ['motion.svg', 'closed_loop.svg', 'trajectory.svg', 'sweep.svg']


def sentences(file):
    """The comment with which a file begins."""
    lines = []
    for line in file.read_text().splitlines():
        if not line.startswith(';'):
            break
        lines.append(line[1:].strip())
    return ' '.join(lines).strip()


def key_of(program, file):
    """What the results depend on: the file, the robots, the program."""
    digest = hashlib.sha256(file.read_bytes() + program.read_bytes())
    for robot in sorted((ROOT / 'config/robots').glob('*.urdf')):
        digest.update(robot.read_bytes())
    return digest.hexdigest()


def results(build, verb, file):
    """The folder with what the command wrote; made again where anything that it depends on has changed."""
    program = build / 'bin/dyntape'
    folder = build / 'gallery' / file.parent.name / file.stem
    key = key_of(program, file)
    marker = folder / '.key'
    if marker.is_file() and marker.read_text() == key:
        return folder
    shutil.rmtree(folder, ignore_errors=True)
    print(f'  dyntape {verb} {file.relative_to(ROOT)}', flush=True)
    run = subprocess.run([program, verb, file, '--output', folder], capture_output=True, text=True)
    if run.returncode != 0:
        sys.exit(f'tools/site: dyntape {verb} {file.relative_to(ROOT)} ended with {run.returncode}:\n{run.stdout}{run.stderr}')
    marker.write_text(key)
    return folder


def card(build, destination, verb, file, run):
    name = f'{file.parent.name}/{file.stem}'
    place = destination / 'gallery' / name
    place.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(file, place / file.name)
    links, text = [f'[file](gallery/{name}/{file.name})'], [f'### {file.stem.replace("_", " ")}', '', sentences(file), '']
    if run:
        folder = results(build, verb, file)
        for found in folder.iterdir():
            if found.suffix in ('.svg', '.json', '.html'):
                shutil.copyfile(found, place / found.name)
        picture = next((p for p in PICTURES if (folder / p).is_file()), None) or next((p.name for p in sorted(folder.glob('*.svg'))), None)
        if picture:
            text += [f'![{file.stem}](gallery/{name}/{picture}){{ width=480 loading=lazy }}', '']
        report = folder / 'report.json'
        if report.is_file():
            verdict = json.loads(report.read_text()).get('verdict')
            text += [f'*{verdict}*', ''] if verdict else []
            links.append(f'[report](gallery/{name}/report.json)')
        if (folder / 'motion.html').is_file():
            links.append(f'[in 3D](gallery/{name}/motion.html)')
    text += [f'`dyntape {verb} config/{name}.info` · ' + ' · '.join(links), '']
    return text


def page(build, destination, run):
    out = ['# Gallery', '', 'Every task, controller, scene and sweep that is shipped, as the command below each of them makes it.', '']
    for folder, title, verb in KINDS:
        out += [f'## {title}', '']
        for file in sorted((ROOT / 'config' / folder).glob('*.info')):
            out += card(build, destination, verb, file, run)
    return re.sub(r'<(?=[A-Za-z])', '&lt;', '\n'.join(out)) + '\n'
