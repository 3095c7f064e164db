#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Pages that play motions, in a real browser: chromium without a screen, without a network.

    player.py PAGE.html ... [--keep FOLDER]    # FOLDER: where the pictures that it took stay

Each page is loaded, taken to three times and photographed.  It fails where the browser has an error or a warning to tell,
asks for anything besides the page, draws nothing, or draws the same at different times; where playing does not go on, or is
slow; where keys, mouse or fingers do nothing; or where a browser without WebGL2 is not told so.
"""
import argparse
import base64
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import time
import zlib

FLAGS = ['--headless=new', '--remote-debugging-pipe', '--no-sandbox', '--disable-gpu-sandbox', '--use-angle=swiftshader',
         '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist', '--window-size=960,640', '--hide-scrollbars',
         '--disable-background-networking', '--disable-component-update', '--no-first-run']
PATIENCE = 120  # seconds for one answer
MOST_SCRIPT = 8  # milliseconds of script a frame, at best: half of what sixty frames a second leave


class Browser:
    """Chromium's protocol over its pipe: JSON, each message ended by a zero byte."""

    def __init__(self, program, profile, *flags):
        to_browser, self.out = os.pipe()
        self.into, from_browser = os.pipe()

        def pipes_at_three_and_four():
            three, four = os.dup(to_browser), os.dup(from_browser)
            os.dup2(three, 3)
            os.dup2(four, 4)

        self.process = subprocess.Popen([program, *FLAGS, *flags, f'--user-data-dir={profile}', 'about:blank'], close_fds=False,
                                        preexec_fn=pipes_at_three_and_four, stdout=subprocess.DEVNULL,
                                        stderr=subprocess.DEVNULL)
        os.close(to_browser)
        os.close(from_browser)
        self.rest, self.number, self.events = b'', 0, []
        target = self.ask('Target.createTarget', {'url': 'about:blank'}, None)['targetId']
        self.session = self.ask('Target.attachToTarget', {'targetId': target, 'flatten': True}, None)['sessionId']
        for domain in ('Page', 'Runtime', 'Network', 'Log'):
            self.ask(domain + '.enable')

    def read(self):
        while b'\0' not in self.rest:
            piece = os.read(self.into, 1 << 20)
            if not piece:
                sys.exit('player.py: chromium has ended')
            self.rest += piece
        message, self.rest = self.rest.split(b'\0', 1)
        return json.loads(message)

    def ask(self, method, params=None, session=''):
        self.number += 1
        message = {'id': self.number, 'method': method, 'params': params or {}}
        if session is not None:
            message['sessionId'] = self.session
        os.write(self.out, json.dumps(message).encode() + b'\0')
        end = time.time() + PATIENCE
        while time.time() < end:
            answer = self.read()
            if answer.get('id') == self.number:
                if 'error' in answer:
                    sys.exit(f'player.py: {method}: {answer["error"]["message"]}')
                return answer['result']
            self.events.append(answer)
        sys.exit(f'player.py: chromium did not answer {method} within {PATIENCE} s')

    def value(self, expression):
        answer = self.ask('Runtime.evaluate', {'expression': expression, 'returnByValue': True, 'awaitPromise': True})
        if 'exceptionDetails' in answer:
            sys.exit(f'player.py: {expression}: {answer["exceptionDetails"]}')
        return answer['result'].get('value')

    def load(self, page):
        self.events.clear()
        self.ask('Page.navigate', {'url': page.as_uri()})
        while not any(e.get('method') == 'Page.loadEventFired' for e in self.events):
            self.events.append(self.read())

    def picture(self, **more):
        return base64.b64decode(self.ask('Page.captureScreenshot', {'format': 'png', **more})['data'])

    def close(self):
        self.ask('Browser.close', {}, None)
        self.process.wait(timeout=30)


def pixels(png):
    """Width, rows of bytes: three or four a pixel.  PNG as chromium writes it: 8 bits, not interlaced."""
    at, data = 8, b''
    while at < len(png):
        length, kind = struct.unpack('>I4s', png[at:at + 8])
        body = png[at + 8:at + 8 + length]
        at += 12 + length
        if kind == b'IHDR':
            width, height, _, color = struct.unpack('>IIBB', body[:10])
        elif kind == b'IDAT':
            data += body
    raw, step = zlib.decompress(data), {2: 3, 6: 4}[color]
    rows, before = [], bytearray(width * step)
    for y in range(height):
        start = y * (width * step + 1)
        kind, row = raw[start], bytearray(raw[start + 1:start + 1 + width * step])
        for x in range(len(row)):
            a, b, c = (row[x - step] if x >= step else 0), before[x], (before[x - step] if x >= step else 0)
            p = a + b - c
            paeth = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            row[x] = (row[x] + (0, a, b, (a + b) // 2, paeth)[kind]) & 255
        rows.append(row)
        before = row
    return step, rows


# The robot's part of the page, away from texts and bars, at half its size.
MIDDLE = {'x': 200, 'y': 120, 'width': 560, 'height': 360, 'scale': 0.5}


def colors_of(png):
    step, rows = pixels(png)
    return [tuple(row[x:x + 3]) for row in rows for x in range(0, len(row), step)]


def complaints(browser):
    """What the browser told while a page was open."""
    for event in browser.events:
        method, params = event.get('method'), event.get('params', {})
        if method == 'Runtime.exceptionThrown':
            yield 'exception: ' + params['exceptionDetails'].get('exception', {}).get('description', '?')
        if method == 'Runtime.consoleAPICalled' and params['type'] in ('error', 'warning'):
            yield 'console: ' + json.dumps(params['args'])
        if method == 'Log.entryAdded' and params['entry']['level'] in ('error', 'warning'):
            if 'GPU stall' not in params['entry']['text']:  # of pictures that are read back, in software
                yield 'log: ' + params['entry']['text']
        if method == 'Network.requestWillBeSent' and not params['request']['url'].startswith(('file:', 'data:')):
            yield 'asks for ' + params['request']['url']


def files_asked_for(browser):
    return {e['params']['request']['url'] for e in browser.events if e.get('method') == 'Network.requestWillBeSent'
            and e['params']['request']['url'].startswith('file:')}


def check(browser, page, keep):
    browser.load(page)
    state = browser.value('window.dyntape_player.state()')
    problems = [state['failure']] if state['failure'] else []
    if state['gl_error']:
        problems.append(f'WebGL error {state["gl_error"]}')
    views = []
    for part in (0, 0.3, 0.55):
        t = state['first'] + part * (state['last'] - state['first'])
        browser.value(f'window.dyntape_player.seek({t})')
        browser.value('new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))')
        if keep:
            (keep / f'{page.stem}_{part}.png').write_bytes(browser.picture())
        views.append(colors_of(browser.picture(clip=MIDDLE)))
        if abs(browser.value('window.dyntape_player.state().time') - t) > 1e-9:
            problems.append(f'is not at {t} after seek')
    colors = min(len(set(view)) for view in views)
    moved = sum(a != b for a, b in zip(views[0], views[1])) / len(views[0])
    if colors < 50:
        problems.append(f'draws {colors} colours: nothing, or next to nothing')
    if moved < 0.001:
        problems.append('looks the same at two times')
    browser.value('document.querySelector("#home").focus(); window.dyntape_player.seek(0)')
    browser.value('document.querySelector("#play").click()')
    # Without a graphics card a frame may take a second of a machine that has other work.
    frames, seconds, playing = browser.value('''new Promise((done) => {
      const times = new Set(), begin = performance.now();
      const count = () => {
        const {time, playing} = window.dyntape_player.state(), seconds = (performance.now() - begin) / 1000;
        times.add(time);
        (seconds < 1 || times.size < 4) && seconds < 30 ? requestAnimationFrame(count) : done([times.size, seconds, playing]);
      };
      count(); })''')
    if not playing or frames < 4:
        problems.append('does not play')
    script = browser.value('''(() => { let least = Infinity;
      for (let i = 0; i < 8; ++i) {
        const begin = performance.now();
        window.dyntape_player.seek(i % 2);
        least = Math.min(least, performance.now() - begin);
      }
      return least; })()''')
    if script > MOST_SCRIPT:
        problems.append(f'takes {script:.1f} ms of script a frame, allowed {MOST_SCRIPT}')
    problems += complaints(browser)
    if files_asked_for(browser) != {page.as_uri()}:
        problems.append('asks for other files: ' + ', '.join(sorted(files_asked_for(browser))))
    print(f'{page.name}: {page.stat().st_size / 1000:.0f} kB, {state["frames"]} frames, {state["shapes"]} shapes, '
          f'{colors} colours, {100 * moved:.1f} % of the pixels move, {script:.1f} ms of '
          f'script a frame, {frames / seconds:.0f} frames a second without a graphics card')
    return [f'{page.name}: {problem}' for problem in problems]


def controls(browser):
    """Keys, mouse and fingers: what does not do what it should."""
    state = lambda: browser.value('window.dyntape_player.state()')
    mouse = lambda kind, x, y, **more: browser.ask('Input.dispatchMouseEvent', {'type': kind, 'x': x, 'y': y, **more})
    touch = lambda i, x: {'x': x, 'y': 300, 'id': i}
    fingers = lambda kind, *xs: browser.ask('Input.dispatchTouchEvent',
                                            {'type': kind, 'touchPoints': [touch(i, x) for i, x in enumerate(xs)]})

    def press(key, text=None):
        more = {'text': text} if text else {}
        browser.ask('Input.dispatchKeyEvent', {'type': 'keyDown', 'key': key, **more})
        browser.ask('Input.dispatchKeyEvent', {'type': 'keyUp', 'key': key})

    def drag(**more):
        mouse('mousePressed', 400, 300, button='left', buttons=1, clickCount=1, **more)
        mouse('mouseMoved', 460, 320, button='left', buttons=1, **more)
        mouse('mouseReleased', 460, 320, button='left', clickCount=1, **more)

    def pinch():
        fingers('touchStart', 350, 450)
        fingers('touchMove', 300, 500)
        fingers('touchEnd')

    def changes(act, *names):
        before, _ = state()['camera'], act()
        after = state()['camera']
        return {name for name in before if before[name] != after[name]} == set(names)

    browser.value('window.dyntape_player.seek(0)')
    if not changes(drag, 'azimuth', 'elevation'):
        yield 'dragging does not turn'
    if not changes(lambda: drag(modifiers=8), 'target'):
        yield 'dragging with shift does not move'
    if not changes(lambda: mouse('mouseWheel', 400, 300, deltaX=0, deltaY=120), 'distance'):
        yield 'the wheel does not zoom'
    distance = state()['camera']['distance']
    pinch()
    if not abs(state()['camera']['distance'] / distance - 0.5) < 1e-6:
        yield 'two fingers that part to twice their distance do not halve that of the camera'
    press('ArrowRight')
    now = state()
    if abs(now['time'] - now['first'] - (now['last'] - now['first']) / (now['frames'] - 1)) > 1e-9:
        yield 'an arrow does not step by a frame'
    press(' ', ' ')
    was = state()['playing']
    press(' ', ' ')
    if not was or state()['playing']:
        yield 'space does not start and stop'


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('pages', nargs='+', type=pathlib.Path)
    parser.add_argument('--keep', type=pathlib.Path)
    parser.add_argument('--dark', action='store_true', help='as for a person who prefers dark pages')
    arguments = parser.parse_args()
    program = shutil.which('chromium')
    if not program:
        sys.exit('player.py: chromium is not installed; tools/setup --full installs it')
    problems = []
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(program, profile)
        if arguments.dark:
            browser.ask('Emulation.setEmulatedMedia', {'features': [{'name': 'prefers-color-scheme', 'value': 'dark'}]})
        for page in arguments.pages:
            problems += check(browser, page.resolve(), arguments.keep)
        problems += controls(browser)
        browser.close()
        browser = Browser(program, profile, '--disable-3d-apis')
        browser.load(arguments.pages[0].resolve())
        state = browser.value('window.dyntape_player.state()')
        if 'no WebGL2' not in state['failure']:
            problems.append('without WebGL2 there is no sentence')
        problems += complaints(browser)
        browser.close()
    print(*problems, sep='\n')
    return 1 if problems else 0


sys.exit(main())
