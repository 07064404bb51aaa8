"""A browser without a screen, driven over the DevTools protocol."""

import base64
import itertools
import json
import shutil
import subprocess
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import cv2
import numpy as np
import pytest
from websockets.sync.client import connect

_ARGUMENTS = (
    "--headless",
    "--no-sandbox",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-background-networking",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--remote-debugging-port=0",
)
_PATIENCE_S = 60.0
_ARROWS = ("ArrowLeft", "ArrowUp", "ArrowRight", "ArrowDown")
_KEYS = {"Tab": 9, "Enter": 13, "Escape": 27, **{name: 37 + k for k, name in enumerate(_ARROWS)}}


class Browser:
    """One page of a fresh Chromium."""

    def __init__(self, folder: Path, width: int = 1000, height: int = 900) -> None:
        program = shutil.which("chromium")
        if program is None:
            pytest.fail("chromium is missing (Debian, Ubuntu: apt-get install chromium)")
        self._process = subprocess.Popen(
            [program, *_ARGUMENTS, f"--user-data-dir={folder}", "about:blank"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self._numbers = itertools.count(1)
        self.told: list[dict[str, Any]] = []  # what the browser said unasked
        with ExitStack() as undo:
            undo.callback(self._quit)
            port = _port_in(folder / "DevToolsActivePort")
            with urlopen(f"http://127.0.0.1:{port}/json") as answer:
                pages = [target for target in json.load(answer) if target["type"] == "page"]
            address = pages[0]["webSocketDebuggerUrl"]
            self._line = undo.enter_context(connect(address, max_size=None, close_timeout=1))
            for domain in ("Page", "Runtime", "Network"):
                self.call(f"{domain}.enable")
            self.resize(width, height)
            self._held = undo.pop_all()

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the DevTools protocol."""
        number = next(self._numbers)
        self._line.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._line.recv(_PATIENCE_S))
            if answer.get("id") == number:
                assert "error" not in answer, answer["error"]
                return dict(answer["result"])
            self.told.append(answer)

    def resize(self, width: int, height: int = 900) -> None:
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **size)

    def open(self, address: str) -> None:
        self.call("Page.navigate", url=address)

    def reload(self) -> None:
        """Load the page again, and return when it is there."""
        loaded, heard = "Page.loadEventFired", len(self.told)
        self.call("Page.reload")
        while loaded not in (told.get("method") for told in self.told[heard:]):
            self.told.append(json.loads(self._line.recv(_PATIENCE_S)))

    def value(self, expression: str) -> Any:
        """Return what a JavaScript expression is worth."""
        answer = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def wait(self, expression: str, until: Callable[[Any], bool] = bool) -> Any:
        """Wait until an expression is worth what it should be, and return that."""
        end = time.monotonic() + _PATIENCE_S
        while True:
            value = self.value(expression)
            if until(value):
                return value
            assert time.monotonic() < end, f"{expression} is {value!r} after {_PATIENCE_S:.0f} s"
            time.sleep(0.05)

    def click(self, selector: str) -> None:
        """Click the middle of an element, as a mouse does."""
        self.click_at(*self.middle(selector))

    def click_at(self, x: float, y: float) -> None:
        """Click a place of the window."""
        self.mouse("mouseMoved", x, y)
        self.mouse("mousePressed", x, y)
        self.mouse("mouseReleased", x, y)

    def middle(self, selector: str) -> tuple[float, float]:
        """Scroll an element into view and return where its middle is."""
        x, y = self.value(
            f"(() => {{ const e = document.querySelector({selector!r});"
            "e.scrollIntoView({block: 'center'}); const b = e.getBoundingClientRect();"
            "return [b.left + b.width / 2, b.top + b.height / 2] })()"
        )
        return x, y

    def mouse(self, kind: str, x: float, y: float, held: bool = False) -> None:
        button = "none" if kind == "mouseMoved" and not held else "left"
        buttons = int(held or kind == "mousePressed")
        self.call(
            "Input.dispatchMouseEvent",
            type=kind,
            x=x,
            y=y,
            button=button,
            buttons=buttons,
            clickCount=int(kind != "mouseMoved"),
        )

    def drag(self, start: tuple[float, float], end: tuple[float, float], steps: int = 8) -> None:
        """Press at one place, move to another, let go."""
        self.mouse("mouseMoved", *start)
        self.mouse("mousePressed", *start)
        for share in np.linspace(0.0, 1.0, steps + 1)[1:]:
            x, y = (a + share * (b - a) for a, b in zip(start, end, strict=True))
            self.mouse("mouseMoved", x, y, held=True)
            time.sleep(0.05)
        self.mouse("mouseReleased", *end)

    def key(self, name: str) -> None:
        """Press a key and let it go."""
        self.press(name)
        self.release(name)

    def press(self, name: str, text: str = "", alt: bool = False, shift: bool = False) -> None:
        """Press a key, or let it repeat; with the text that it types."""
        self._key("keyDown" if text else "rawKeyDown", name, text, alt + 8 * shift)

    def release(self, name: str) -> None:
        """Let go of a key."""
        self._key("keyUp", name)

    def _key(self, kind: str, name: str, text: str = "", modifiers: int = 0) -> None:
        code = _KEYS.get(name, ord(name[0]))
        self.call(
            "Input.dispatchKeyEvent",
            type=kind,
            key=name,
            text=text,
            windowsVirtualKeyCode=code,
            modifiers=modifiers,
        )

    def image(self, selector: str) -> Any:
        """Return how an element looks, (height, width, 3)."""
        self.middle(selector)
        clip = self.value(
            f"(() => {{ const b = document.querySelector({selector!r}).getBoundingClientRect();"
            "return {x: b.left + scrollX, y: b.top + scrollY, width: b.width, height: b.height,"
            "scale: 1} })()"
        )
        data = self.call("Page.captureScreenshot", format="png", clip=clip)["data"]
        return cv2.imdecode(np.frombuffer(base64.b64decode(data), np.uint8), cv2.IMREAD_COLOR)

    @property
    def complaints(self) -> list[Any]:
        """Exceptions that nobody caught."""
        return [
            message["params"]["exceptionDetails"]
            for message in self.told
            if message["method"] == "Runtime.exceptionThrown"
        ]

    @property
    def addresses(self) -> set[str]:
        """All that was fetched."""
        requests = (m for m in self.told if m["method"] == "Network.requestWillBeSent")
        return {message["params"]["request"]["url"] for message in requests}

    def close(self) -> None:
        self._held.close()

    def _quit(self) -> None:
        self._process.terminate()
        self._process.wait(timeout=20)


def _port_in(file: Path) -> int:
    end = time.monotonic() + _PATIENCE_S
    while time.monotonic() < end:
        if file.is_file() and len(lines := file.read_text().splitlines()) == 2:
            return int(lines[0])
        time.sleep(0.05)
    pytest.fail("chromium does not start")
