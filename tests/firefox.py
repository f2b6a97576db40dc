"""Firefox as it is installed, through Marionette, the protocol that it has built in: pages as tests open them in Chromium."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

# Seconds that Firefox may take to start, and a script to run.
START, SCRIPT = 60.0, 60.0
PREFERENCES = {
    "webgl.force-enabled": True, "webgl.disabled": False, "app.update.enabled": False, "browser.shell.checkDefaultBrowser": False,
    "datareporting.policy.dataSubmissionEnabled": False, "browser.startup.page": 0, "browser.aboutwelcome.enabled": False,
    "network.captive-portal-service.enabled": False, "network.connectivity-service.enabled": False}
# Messages of the page on the console, and the requests that OBSERVE has seen.
SAID = """return [...Services.console.getMessageArray().filter(
    m => m instanceof Ci.nsIScriptError && m.sourceName.startsWith(arguments[0])).map(m => m.errorMessage),
    ...window.symdynAsked.splice(0)];"""
# Requests of all pages from now on, but for those of Firefox itself: of documents with a principal of their own.
OBSERVE = """Services.console.reset();
Services.prefs.setIntPref("layout.css.prefers-color-scheme.content-override", arguments[0]);
if (!window.symdynAsked) {
    window.symdynAsked = [];
    Services.obs.addObserver(channel => {
        const by = channel.QueryInterface(Ci.nsIHttpChannel).loadInfo.loadingPrincipal;
        if (by && by.isContentPrincipal) window.symdynAsked.push(channel.URI.spec);
    }, "http-on-modify-request");
}"""


class Protocol:
    """Commands of Marionette over a socket: `length:[0, number, name, parameters]`, answered by `length:[1, number, fault,
    result]`."""

    def __init__(self, port: int) -> None:
        self._numbers = itertools.count(1)
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=SCRIPT)
        self._rest = b""
        self._read()

    def __call__(self, name: str, **parameters: Any) -> Any:
        """Run a command. Raises RuntimeError with what Firefox reports."""
        text = json.dumps([0, next(self._numbers), name, parameters]).encode()
        self._socket.sendall(b"%d:%s" % (len(text), text))
        _, _, fault, result = self._read()
        if fault is not None:
            raise RuntimeError(f"{name}: {fault['message']}")
        return result["value"] if isinstance(result, dict) and set(result) == {"value"} else result

    def _read(self) -> Any:
        while b":" not in self._rest:
            self._more()
        size, _, self._rest = self._rest.partition(b":")
        while len(self._rest) < int(size):
            self._more()
        text, self._rest = self._rest[:int(size)], self._rest[int(size):]
        return json.loads(text)

    def _more(self) -> None:
        found = self._socket.recv(1 << 20)
        if not found:
            raise RuntimeError("Firefox has closed the connection")
        self._rest += found


class FirefoxPage:
    """The one page, with those methods of a page of Playwright that tests for all browsers use."""

    def __init__(self, run: Protocol, viewport: dict[str, int], color_scheme: str) -> None:
        self._run = run
        self._address = ""
        with self._inside():
            self._of_browser(OBSERVE, 0 if color_scheme == "dark" else 1)
        run("WebDriver:SetWindowRect", width=viewport["width"], height=viewport["height"])
        wide, high = self.evaluate("[outerWidth - innerWidth, outerHeight - innerHeight]")
        run("WebDriver:SetWindowRect", width=viewport["width"] + wide, height=viewport["height"] + high)

    @contextmanager
    def _inside(self) -> Iterator[None]:
        """Scripts of the browser in place of scripts of the page."""
        self._run("Marionette:SetContext", value="chrome")
        yield
        self._run("Marionette:SetContext", value="content")

    def _of_browser(self, script: str, argument: Any) -> Any:
        """Result of a script of the browser; its sandbox stays, and with it what observes requests."""
        return self._run("WebDriver:ExecuteScript", script=script, args=[argument], sandbox="symdyn", newSandbox=False)

    def goto(self, address: str) -> None:
        self._address = address
        self._run("WebDriver:Navigate", url=address)

    def evaluate(self, text: str, argument: Any = None) -> Any:
        """The value of an expression, or of a function for an argument."""
        script = f"const value = ({text}); return typeof value === 'function' ? value(arguments[0]) : value;"
        return self._run("WebDriver:ExecuteScript", script=script, args=[argument], sandbox=None)

    def wait_for_function(self, text: str, timeout: float = 1000 * SCRIPT) -> None:
        """Raises TimeoutError unless an expression gets true within so many milliseconds."""
        end = time.monotonic() + timeout / 1000
        while not self.evaluate(f"Boolean({text})"):
            if time.monotonic() > end:
                raise TimeoutError(text)
            time.sleep(0.05)

    def click(self, selector: str) -> None:
        self.evaluate("selector => { document.querySelector(selector).click(); }", selector)

    def get_attribute(self, selector: str, name: str) -> Any:
        return self.evaluate("([selector, name]) => document.querySelector(selector).getAttribute(name)", [selector, name])

    def text_content(self, selector: str) -> Any:
        return self.evaluate("selector => document.querySelector(selector).textContent", selector)

    def said(self) -> list[str]:
        """Messages of the page on the console, and requests of pages to the network."""
        with self._inside():
            found: list[str] = self._of_browser(SAID, self._address)
        return found

    def close(self) -> None:
        self._run("WebDriver:Navigate", url="about:blank")


class Firefox:
    """Firefox with one page at a time."""

    def __init__(self, run: Protocol) -> None:
        self._run = run

    def new_page(self, viewport: dict[str, int], color_scheme: str = "light") -> FirefoxPage:
        return FirefoxPage(self._run, viewport, color_scheme)


@contextmanager
def firefox() -> Iterator[Firefox]:
    """Firefox on a display of its own; the test is skipped without it, or without what gives it WebGL."""
    program, display = shutil.which("firefox") or shutil.which("firefox-esr"), shutil.which("xvfb-run")
    if program is None:
        pytest.skip("no Firefox on this machine")
    if display is None:
        pytest.skip("no xvfb-run on this machine: without a display Firefox has no WebGL")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        settings = "\n".join(f"user_pref({json.dumps(name)}, {json.dumps(value)});"
                             for name, value in {**PREFERENCES, "marionette.port": port}.items())
        Path(folder, "user.js").write_text(settings, encoding="utf-8")
        command = [display, "-a", "-s", "-screen 0 1600x1200x24", program, "--marionette", "--remote-allow-system-access",
                   "--no-remote", "--profile", folder]
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              env={**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1"}) as running:
            run = _connected(port, running)
            try:
                run("WebDriver:NewSession", capabilities={"alwaysMatch": {}})
                yield Firefox(run)
            finally:
                with suppress(RuntimeError, OSError):
                    run("Marionette:Quit", flags=["eForceQuit"])
                running.wait(START)


def _connected(port: int, running: subprocess.Popen[bytes]) -> Protocol:
    """The protocol as soon as Firefox listens. Raises RuntimeError where it does not."""
    end = time.monotonic() + START
    while time.monotonic() < end and running.poll() is None:
        with suppress(OSError):
            return Protocol(port)
        time.sleep(0.1)
    running.terminate()
    raise RuntimeError("Firefox does not listen to Marionette")
