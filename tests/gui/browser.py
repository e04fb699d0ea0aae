"""The viewer as its user has it: the command in a process of its own, and its page in a headless Chromium."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from io import BytesIO
from pathlib import Path
from threading import Thread
from time import monotonic, sleep
from typing import Any

import numpy as np
from PIL import Image

from bvbedit import BvbError
from bvbedit_gui.opengl import require_opengl
from bvbedit_gui.volume_scene import HALVES, LINES, VIEWS
from bvbedit_gui.volume_view import TEXT_SIZE

# Milliseconds that anything in the page may take on a slow machine.
PATIENCE = 240_000
ARGUMENTS = [
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
]
COMMAND = [sys.executable, "-c", "from bvbedit.cli import main; main()"]


@cache
def missing() -> str:
    """Return what this machine lacks to show the page, with the line that installs it, or nothing."""
    if shutil.which("chromium") is None:
        return "no Chromium: apt-get install chromium"
    try:
        require_opengl()
    except BvbError as error:
        return str(error)
    return ""


@contextmanager
def chromium() -> Iterator[Any]:
    """Run a browser."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=ARGUMENTS)
        yield browser
        browser.close()


class Served:
    """A viewer in a process of its own."""

    def __init__(self, folder: Path, *arguments: str, environment: dict[str, str] | None = None) -> None:
        self.folder = folder
        self._errors = (folder / ".stderr").open("w+")
        self.process = subprocess.Popen(
            [*COMMAND, "view", *arguments, "--no-browser"],
            cwd=folder,
            env={**os.environ, **(environment or {})},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            text=True,
        )
        assert self.process.stdout is not None
        self.lines: list[str] = []
        self.url = ""
        while not self.url and (line := self.process.stdout.readline()):
            self.lines.append(line.rstrip())
            found = re.search(r"http://\S+", line)
            self.url = found.group() if found else ""
        if not self.url:
            self.process.wait()
            raise AssertionError(f"the viewer did not start: {self.complaints}")
        self.port = int(self.url.split(":")[2].split("/")[0])

    @property
    def complaints(self) -> str:
        """What was written to stderr."""
        self._errors.seek(0)
        return self._errors.read()

    def interrupt(self) -> int:
        """Do what Ctrl-C does; return the exit status."""
        self.process.send_signal(signal.SIGINT)
        try:
            assert self.process.stdout is not None
            self.lines += self.process.stdout.read().splitlines()
            return self.process.wait(60)
        finally:
            self.process.kill()
            self.process.wait()


@contextmanager
def served(folder: Path, *arguments: str) -> Iterator[Served]:
    """Run a viewer in a folder; check that it ends well and had nothing to complain of."""
    viewer = Served(folder, *arguments)
    try:
        yield viewer
    except BaseException:
        viewer.process.kill()
        print(viewer.complaints)
        raise
    assert (viewer.interrupt(), viewer.complaints) == (0, "")


class Desk:
    """A page of the viewer, and hands that work on it."""

    def __init__(self, context: Any, url: str) -> None:
        self.page = context.new_page()
        self.page.set_default_timeout(PATIENCE)
        self.complaints: list[str] = []
        self.page.on("console", lambda m: m.type in ("error", "warning") and self.complaints.append(m.text))
        self.page.on("pageerror", lambda e: self.complaints.append(str(e)))
        self.page.goto(url)
        self.wait("documents", "value => value !== undefined")

    def mark(self, name: str) -> Any:
        """Return the control with this mark."""
        return self.page.locator(f'[data-test="{name}"]').locator("visible=true")

    def state(self, name: str) -> Any:
        """Return a variable of the page."""
        return self.page.evaluate("name => window.trame.state.get(name)", name)

    def known(self, name: str) -> Any:
        """Return what the server knows a variable to be: the page's changes are on their way to it for a moment."""
        asked = "name => window.trame.client.getRemote().Trame.getState().then(known => known.state[name])"
        return self.page.evaluate(asked, name)

    def wait(self, name: str, holds: str, timeout: float = PATIENCE) -> Any:
        """Wait until a JavaScript function holds of a variable of the page; return its value."""
        self.page.wait_for_function(
            f"name => window.trame && window.trame.state && ({holds})(window.trame.state.get(name))",
            arg=name,
            timeout=timeout,
        )
        return self.state(name)

    def soon(self, what: Callable[[], Any], holds: Callable[[Any], bool]) -> Any:
        """Look again and again until something holds of what is seen; return it."""
        end = monotonic() + PATIENCE / 1000
        while True:
            seen = what()
            if holds(seen) or monotonic() > end:
                assert holds(seen), seen
                return seen
            self.page.wait_for_timeout(50)

    def click(self, name: str) -> None:
        """Click the control with this mark."""
        self.mark(name).click()

    def fill(self, name: str, value: object) -> None:
        """Type into a field."""
        self.mark(f"field {name}").locator("input").fill(str(value))

    def slide(self, name: str, share: float) -> None:
        """Put a slider to a share of its length."""
        box = self.mark(f"slider {name}").locator(".v-slider-track").bounding_box()
        self.page.mouse.click(box["x"] + share * box["width"], box["y"] + box["height"] / 2)

    def choose(self, name: str, title: str) -> None:
        """Choose from a list."""
        self.mark(name).locator(".v-field").click()
        self.page.locator(".v-overlay .v-list-item").get_by_text(title, exact=True).click()
        self.page.locator(".v-overlay--active .v-list").wait_for(state="hidden")

    def open(self, name: str) -> None:
        """Open a file of the folder from the dialog."""
        self.click("open")
        self.dialog("open").locator('[data-test="file"]').get_by_text(name, exact=True).click()

    def dialog(self, name: str) -> Any:
        """Return a dialog."""
        return self.page.locator(f'[data-dialog="{name}"]').locator("visible=true")

    def picture(self, name: str) -> np.ndarray:
        """Return what a picture shows now, (rows, columns, 3)."""
        shot = self.page.locator(f'[data-picture="{name}"]').screenshot(type="png")
        return np.asarray(Image.open(BytesIO(shot)).convert("RGB"))

    def point_at(self, points: np.ndarray, view: str) -> np.ndarray:
        """Return where points of the volume's box (n, 3) stand in its picture (n, 2), from its upper left corner."""
        box = self.page.locator('[data-picture="volume"]').bounding_box()
        return projected(points, view, round(box["width"]), round(box["height"]))

    def click_volume(self, place: np.ndarray) -> None:
        """Click a place in the volume's picture."""
        box = self.page.locator('[data-picture="volume"]').bounding_box()
        self.page.mouse.click(box["x"] + place[0], box["y"] + place[1])


def projected(points: np.ndarray, view: str, width: int, height: int) -> np.ndarray:
    """Return where points of the box stand in a picture: the camera of ``VolumeScene``, worked out anew."""
    kind = "oblique" if view == "oblique" else "side"
    room = [max(p - n * TEXT_SIZE, p / 3) for n, p in zip(LINES[kind], (height, width), strict=True)]
    half_height, half_width = (h * p / r for h, p, r in zip(HALVES[kind], (height, width), room, strict=True))
    half = max(half_height, half_width * height / width)
    eye, focus = (np.array(p) for p in VIEWS[view])
    ahead = (focus - eye) / np.linalg.norm(focus - eye)
    right = np.cross(ahead, [0, 0, 1])
    right /= np.linalg.norm(right)
    away = (points - focus) * height / (2 * half)
    return np.stack([width / 2 + away @ right, height / 2 - away @ np.cross(right, ahead)], axis=-1)


def until(holds: Callable[[], bool], seconds: float = PATIENCE / 1000) -> bool:
    """Return whether something comes to hold within a time."""
    end = monotonic() + seconds
    while not holds():
        if monotonic() > end:
            return False
        sleep(0.05)
    return True


class Relay:
    """Stands between a browser and a viewer, and can cut all connections, as a network does."""

    def __init__(self, port: int) -> None:
        self._to = port
        self._open: list[socket.socket] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with suppress(OSError):
            while True:
                ours, _ = self._listener.accept()
                theirs = socket.create_connection(("127.0.0.1", self._to))
                self._open += [ours, theirs]
                for a, b in ((ours, theirs), (theirs, ours)):
                    Thread(target=self._pump, args=(a, b), daemon=True).start()

    def _pump(self, a: socket.socket, b: socket.socket) -> None:
        with suppress(OSError):
            while received := a.recv(1 << 16):
                b.sendall(received)
        for end in (a, b):
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)

    def cut(self) -> None:
        """End all connections that stand; new ones can be made."""
        cut, self._open = self._open, []
        for end in cut:
            with suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def close(self) -> None:
        """End for good."""
        self._listener.close()
        self.cut()
