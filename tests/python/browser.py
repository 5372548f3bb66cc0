"""A headless Chromium by its DevTools protocol, for tests: WebGL in software, nothing from a network."""

import itertools
import json
import pathlib
import shutil
import subprocess
import tempfile
import time
import urllib.request

import websockets.sync.client


def program():
    """Debian's Chromium, or None."""
    return shutil.which("chromium")


class Page:
    """One page; use with `with`."""

    def __init__(self, url, size=(1100, 800), patience_s=60.0):
        self._patience_s = patience_s
        self._folder = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        self._numbers = itertools.count(1)
        self.errors = []
        self._browser = subprocess.Popen(
            [
                program(),
                "--headless=new",
                "--no-sandbox",
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
                "--disable-background-networking",
                f"--window-size={size[0]},{size[1]}",
                f"--user-data-dir={self._folder.name}",
                "--remote-debugging-port=0",
                "about:blank",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            port_file = pathlib.Path(self._folder.name) / "DevToolsActivePort"
            self._until(lambda: port_file.exists() and port_file.read_text().count("\n"), "the browser's port")
            address = f"http://127.0.0.1:{port_file.read_text().splitlines()[0]}/json/list"
            pages = self._until(
                lambda: [page for page in json.load(urllib.request.urlopen(address)) if page["type"] == "page"], "a page"
            )
            self._socket = websockets.sync.client.connect(pages[0]["webSocketDebuggerUrl"], max_size=None)
            self.call("Runtime.enable")
            self.call("Page.enable")
            self.call("Page.navigate", url=str(url))
        except BaseException:
            self.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._browser.terminate()
        self._browser.wait(30)
        self._folder.cleanup()

    def call(self, method, **parameters):
        """Result of a DevTools method; exceptions in the page are collected in `errors` on the way."""
        number = next(self._numbers)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self._socket.recv(timeout=self._patience_s))
            if answer.get("method") == "Runtime.exceptionThrown":
                self.errors.append(answer["params"]["exceptionDetails"])
            if answer.get("id") == number:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']}")
                return answer["result"]

    def value(self, expression):
        """Value of a JavaScript expression, a promise's when it is one."""
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(f"{expression}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def wait(self, expression, what=None):
        """Value of an expression as soon as it is true."""
        return self._until(lambda: self.value(expression), what or expression)

    def click(self, text):
        """Clicks the button with this label."""
        find = f"[...document.querySelectorAll('button')].find(b => b.textContent.trim() === {json.dumps(text)})"
        self.wait(f"!!{find}", f"a button '{text}'")
        self.value(f"{find}.click()")

    def screenshot(self):
        """PNG as bytes."""
        import base64

        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def _until(self, condition, what):
        end = time.monotonic() + self._patience_s
        while not (value := condition()):
            if time.monotonic() > end:
                raise TimeoutError(f"no {what} within {self._patience_s:.0f} s")
            time.sleep(0.05)
        return value
