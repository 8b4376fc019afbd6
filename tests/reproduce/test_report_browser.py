"""The report in a browser: no error, verdicts reachable, a surface that turns, readable at phone width."""

from __future__ import annotations

import shutil

import pytest

from pliant import shapes
from pliant.reproduce import Experiment, Findings, Row, reproduce
from pliant.reproduce import run as running

pytestmark = pytest.mark.skipif(shutil.which("chromium") is None, reason="chromium is not installed")


@pytest.fixture
def report(tmp_path, monkeypatch):
    def fine(bench):
        ball = shapes.icosphere(2)
        bench.surface(ball, {"height": ball.vertices[:, 2]}, "A ball")
        rows = tuple(Row(f"value {i}", 1.0, 2.0, -1.234, -0.123, "noted") for i in range(20))
        return Findings("holds partly", "In part.", "a ball", rows)

    made = (Experiment("table-2.1", "Fine", "A claim of some length.", "criterion", fine),)
    monkeypatch.setattr(running, "experiments", lambda: made)
    reproduce(folder=tmp_path)
    return tmp_path / "report.html"


@pytest.fixture
def browser():
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    for flag in ("--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"):
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    yield driver
    driver.quit()


def test_the_report_works_without_an_error(browser, report):
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import WebDriverWait

    for width in (1200, 375):
        browser.set_window_size(width, 900)
        browser.get(report.as_uri())
        wide = browser.execute_script("return document.documentElement.scrollWidth - window.innerWidth")
        assert wide <= 0, f"scrolls sideways at {width} px"
    # By keyboard: past the verdicts with the first link, the folded table and the surface with Enter.
    from selenium.webdriver.common.keys import Keys

    def active(key):
        browser.switch_to.active_element.send_keys(key)
        return browser.switch_to.active_element

    assert active(Keys.TAB).get_attribute("class") == "skip"
    summary = browser.find_element(By.CSS_SELECTOR, "details summary")
    assert not browser.find_element(By.CSS_SELECTOR, "details").get_attribute("open")
    browser.execute_script("arguments[0].focus()", summary)
    summary.send_keys(Keys.ENTER)
    assert browser.find_element(By.CSS_SELECTOR, "details").get_attribute("open")
    cut = "return [...document.querySelectorAll('details td')].filter((t) => t.scrollWidth > t.clientWidth + 1).length"
    assert browser.execute_script(cut) == 0
    button = browser.find_element(By.CSS_SELECTOR, "button[data-surface]")
    browser.execute_script("arguments[0].focus()", button)
    button.send_keys(Keys.ENTER)
    frame = browser.find_element(By.TAG_NAME, "iframe")
    browser.switch_to.frame(frame)
    WebDriverWait(browser, 20).until(
        lambda b: b.execute_script(
            "return document.getElementById('loading') === null || "
            "document.getElementById('loading').hidden || !document.getElementById('loading').offsetParent"
        )
    )
    assert browser.find_element(By.ID, "canvas")
    browser.switch_to.default_content()
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
