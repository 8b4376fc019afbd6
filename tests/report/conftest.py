"""A browser for the tests of pages."""

from __future__ import annotations

import base64
import shutil
import time

import numpy as np
import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
FLAGS = (
    "--headless=new --no-sandbox --disable-gpu --use-angle=swiftshader --enable-unsafe-swiftshader "
    "--disable-background-networking --disable-component-update --disable-sync --no-first-run "
    "--disable-dev-shm-usage --hide-scrollbars --window-size=1280,900"
)


class Browser:
    """Chromium without a window, and what tests of pages do with it."""

    def __init__(self, driver):
        self.driver = driver
        self.run = driver.execute_script

    def open(self, page, size=(1280, 900)):
        """Open a file and wait until its surfaces are drawn."""
        self.driver.set_window_size(*size)
        self.driver.get(page.as_uri())
        deadline = time.monotonic() + 60
        while not self.run("return document.documentElement.dataset.ready"):
            assert time.monotonic() < deadline, self.run("return document.body.innerText")
            time.sleep(0.05)
        return self

    def wide(self, width, height):
        """Make the page as large as a screen: windows are never as narrow as phones."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        # Sizes are observed, and drawn, in the frames that follow.
        self.driver.execute_async_script(
            "const done = arguments[0]; requestAnimationFrame(() => requestAnimationFrame(() => done()))"
        )

    def choose(self, name, value):
        """Choose in a control, as if by hand."""
        self.run(
            "const c = document.getElementById(arguments[0]); c.value = arguments[1];"
            "c.dispatchEvent(new Event('change'))",
            name,
            value,
        )

    def picture(self, draw="view.draw()"):
        """(h, w, 3) what is on the canvas of a page of one surface after ``draw``."""
        width, text = self.run(
            "const { view } = pliant, { gl, canvas } = view;" + draw + ";"
            """const out = new Uint8Array(4 * canvas.width * canvas.height);
            gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, out);
            let text = '';
            for (let i = 0; i < out.length; i += 8192) text += String.fromCharCode(...out.subarray(i, i + 8192));
            return [canvas.width, btoa(text)]"""
        )
        rows = np.frombuffer(base64.b64decode(text), np.uint8).reshape(-1, width, 4)
        return rows[::-1, :, :3].astype(int)

    def errors(self):
        """What went wrong since the last call, as the console has it."""
        return [entry for entry in self.driver.get_log("browser") if entry["level"] == "SEVERE"]


@pytest.fixture(scope="module")
def browser():
    """A browser; where there is none the test is skipped."""
    webdriver = pytest.importorskip("selenium.webdriver")
    if not (CHROMIUM and DRIVER):
        pytest.skip("needs chromium and chromedriver")
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in FLAGS.split():
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    yield Browser(driver)
    driver.quit()
