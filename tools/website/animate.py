#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A moving picture (SVG) of the motion in a page that `--output` wrote: spheres, cylinders and capsules, seen from the page's own first view.

    tools/website/animate.py out/arm_around_obstacles/motion.html docs/arm_moves.svg
"""
import json
import math
import pathlib
import re
import sys

WIDTH, HEIGHT, FRAMES, SECONDS = 720, 480, 48, 4.0
AZIMUTH, ELEVATION = -math.pi / 3, math.pi / 10


def rotated(q, p):
    x, y, z, w = q
    u = (x, y, z)
    t = [2 * (u[(i + 1) % 3] * p[(i + 2) % 3] - u[(i + 2) % 3] * p[(i + 1) % 3]) for i in range(3)]
    return [p[i] + w * t[i] + u[(i + 1) % 3] * t[(i + 2) % 3] - u[(i + 2) % 3] * t[(i + 1) % 3] for i in range(3)]


class View:
    """World, m, to picture; without perspective."""

    def __init__(self, scene):
        ca, sa, ce, se = math.cos(AZIMUTH), math.sin(AZIMUTH), math.cos(ELEVATION), math.sin(ELEVATION)
        self.back, self.right, self.up = (ce * ca, ce * sa, se), (-sa, ca, 0), (-se * ca, -se * sa, ce)
        self.center, self.scale = scene['center'], 0.62 * HEIGHT / scene['radius']

    def of(self, p):
        d = [a - b for a, b in zip(p, self.center)]
        along = lambda axis: sum(a * b for a, b in zip(d, axis))
        return WIDTH / 2 + self.scale * along(self.right), HEIGHT / 2 - self.scale * along(self.up), along(self.back)


def in_world(pose, body, p):
    if body < 0:
        return p
    i = 7 * body
    return [a + b for a, b in zip(pose[i:i + 3], rotated(pose[i + 3:i + 7], p))]


def ends(shape):
    """The ends of its axis in its body: one for a sphere, two otherwise."""
    half = [0] if shape['kind'] == 'sphere' else [-shape['scale'][2] / 2, shape['scale'][2] / 2]
    return [[a + b for a, b in zip(shape['p'], rotated(shape['q'], [0, 0, h]))] for h in half]


def tones(color, depth):
    light = 0.85 + 0.15 * depth
    return '#' + ''.join(f'{round(255 * min(1, c * light)):02x}' for c in color[:3])


def animated(name, values):
    texts = [f'{v:.1f}' for v in values]
    if len(set(texts)) == 1:
        return f' {name}="{texts[0]}"', ''
    there_and_back = texts + [texts[-1]] * 6 + texts[::-1] + [texts[0]] * 6
    return f' {name}="{texts[0]}"', f'<animate attributeName="{name}" dur="{2 * SECONDS:g}s" repeatCount="indefinite" values="{";".join(there_and_back)}"/>'


def element(shape, poses, view):
    tracks = [[view.of(in_world(pose, shape['body'], end)) for pose in poses] for end in ends(shape)]
    depth = sum(p[2] for track in tracks for p in track) / sum(map(len, tracks))
    radius, color = view.scale * shape['scale'][0], tones(shape['color'], depth)
    if len(tracks) == 1:
        parts = [animated('cx', [p[0] for p in tracks[0]]), animated('cy', [p[1] for p in tracks[0]])]
        head = f'<circle r="{radius:.1f}" fill="{color}"'
    else:
        parts = [animated(f'{axis}{k + 1}', [p[i] for p in track]) for k, track in enumerate(tracks) for i, axis in enumerate('xy')]
        cap = 'butt' if shape['kind'] == 'cylinder' else 'round'
        head = f'<line stroke="{color}" stroke-width="{2 * radius:.1f}" stroke-linecap="{cap}"'
    tag = head.split()[0][1:]
    return depth, f'{head}{"".join(p[0] for p in parts)}>{"".join(p[1] for p in parts)}</{tag}>'


def ground(scene, view):
    half, (x, y, _) = 1.1 * scene['radius'], scene['center']
    corners = [view.of([x + a * half, y + b * half, scene['ground']]) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return f'<polygon points="{" ".join(f"{p[0]:.1f},{p[1]:.1f}" for p in corners)}" fill="#e9ecf1"/>'


def path(scene, view):
    """Of the point of the last body that is farthest from its origin."""
    tips = [end for s in scene['shapes'] if s['body'] == scene['bodies'] - 1 for end in ends(s)]
    tip = max(tips, key=lambda p: sum(x * x for x in p))
    points = [view.of(in_world(pose, scene['bodies'] - 1, tip)) for pose in scene['poses']]
    return f'<polyline points="{" ".join(f"{p[0]:.1f},{p[1]:.1f}" for p in points)}" fill="none" stroke="#0072b2" stroke-width="1.5" stroke-dasharray="5 4"/>'


def main():
    page, picture = map(pathlib.Path, sys.argv[1:])
    scene = json.loads(re.search(r'id="scene">(.*?)</script>', page.read_text(), re.DOTALL).group(1))
    last = len(scene['t']) - 1
    poses = [scene['poses'][round(last * k / (FRAMES - 1))] for k in range(FRAMES)]
    view = View(scene)
    known = [s for s in scene['shapes'] if s['kind'] in ('sphere', 'cylinder', 'capsule')]
    drawn = [text for _, text in sorted(element(shape, poses, view) for shape in known)]
    picture.write_text(f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}">\n'
                       f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#f7f8fa"/>\n' + '\n'.join([ground(scene, view), path(scene, view), *drawn]) + '\n</svg>\n')


main()
