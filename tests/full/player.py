#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Pages that play motions, in a real browser: chromium without a screen, without a network.

    player.py PAGE.html ... [--keep FOLDER]    # FOLDER: where the pictures that it took stay

Each page is loaded, taken to four times and photographed.  It fails where the browser has an error or a warning to tell, asks for
anything besides the page, draws nothing, or draws the same at different times; or where playing does not go on, or is slow.
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
MOST_SCRIPT = 8  # milliseconds a frame: half of what sixty frames a second leave


class Browser:
    """Chromium's protocol over its pipe: JSON, each message ended by a zero byte."""

    def __init__(self, program, profile):
        to_browser, self.out = os.pipe()
        self.into, from_browser = os.pipe()

        def pipes_at_three_and_four():
            three, four = os.dup(to_browser), os.dup(from_browser)
            os.dup2(three, 3)
            os.dup2(four, 4)

        self.process = subprocess.Popen([program, *FLAGS, f'--user-data-dir={profile}', 'about:blank'], close_fds=False,
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

    def picture(self):
        return base64.b64decode(self.ask('Page.captureScreenshot', {'format': 'png'})['data'])

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


def middle(png):
    """Pixels of the robot's part of the page, away from texts and bars."""
    step, rows = pixels(png)
    return [tuple(row[x:x + 3]) for row in rows[120:520] for x in range(200 * step, 760 * step, step)]


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
    for part in (0, 0.3, 0.55, 1):
        t = state['first'] + part * (state['last'] - state['first'])
        browser.value(f'window.dyntape_player.seek({t})')
        browser.value('new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))')
        png = browser.picture()
        if keep:
            (keep / f'{page.stem}_{part}.png').write_bytes(png)
        views.append(middle(png))
        if abs(browser.value('window.dyntape_player.state().time') - t) > 1e-9:
            problems.append(f'is not at {t} after seek')
    colors = len(set(views[0]))
    moved = sum(a != b for a, b in zip(views[0], views[1])) / len(views[0])
    if colors < 50:
        problems.append(f'draws {colors} colours: nothing, or next to nothing')
    if moved < 0.001:
        problems.append('looks the same at two times')
    browser.value('document.querySelector("#home").focus(); window.dyntape_player.seek(0)')
    browser.value('document.querySelector("#play").click()')
    frames, times, playing = browser.value('''new Promise((done) => {
      let n = 0; const times = new Set(), end = performance.now() + 1000;
      const count = () => {
        const {time, playing} = window.dyntape_player.state();
        ++n, times.add(time);
        performance.now() < end ? requestAnimationFrame(count) : done([n, times.size, playing]);
      };
      count(); })''')
    if not playing or times < 3:
        problems.append('does not play')
    script = browser.value('''(() => { const begin = performance.now(); let n = 0;
      for (; n < 40; ++n) window.dyntape_player.seek(n % 2); return (performance.now() - begin) / n; })()''')
    if script > MOST_SCRIPT:
        problems.append(f'takes {script:.1f} ms of script a frame, allowed {MOST_SCRIPT}')
    problems += complaints(browser)
    if files_asked_for(browser) != {page.as_uri()}:
        problems.append('asks for other files: ' + ', '.join(sorted(files_asked_for(browser))))
    print(f'{page.name}: {page.stat().st_size / 1000:.0f} kB, {state["frames"]} frames, {state["shapes"]} shapes, '
          f'{colors} colours, {100 * moved:.1f} % of the pixels move, {script:.1f} ms of '
          f'script a frame, {frames} frames a second without a graphics card')
    return [f'{page.name}: {problem}' for problem in problems]


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
        browser.close()
    print(*problems, sep='\n')
    return 1 if problems else 0


sys.exit(main())
