"""The search page in a real browser: choose, see, filter, look closer, by pointer and by keyboard, on a phone too."""

from __future__ import annotations

import shutil
import socket
import threading
import time

import pytest
from tiny_encoder import TinyEncoder, encoded, scene, write_classes

from pliant.retrieval import ServiceLimits, ShapeIndex, add_folder, create_app

pytest.importorskip("faiss")
uvicorn = pytest.importorskip("uvicorn")
webdriver = pytest.importorskip("selenium.webdriver")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
pytestmark = [
    pytest.mark.skipif(not (CHROMIUM and DRIVER), reason="needs chromium and chromedriver"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]
FLAGS = (
    "--headless=new --no-sandbox --disable-gpu --disable-background-networking --disable-component-update "
    "--disable-sync --no-first-run --disable-dev-shm-usage --force-prefers-reduced-motion --window-size=1000,800"
)
LEFT, RIGHT, ESCAPE, ENTER, TAB = "\ue012", "\ue014", "\ue00c", "\ue007", "\ue004"
TOKEN = "correct-horse-battery"
NASTY = '<img src=x onerror="document.title=1">'


@pytest.fixture(scope="module")
def browser():
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    options.binary_location = CHROMIUM
    for flag in FLAGS.split():
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(DRIVER))
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def pictures(tmp_path_factory):
    """Six hills, eight lakes and one class whose name would be markup if it were not escaped."""
    folder = write_classes(tmp_path_factory.mktemp("root") / "pictures", {"green_hills": 6, "lakes": 8})
    queries = folder.parent / "queries"
    queries.mkdir()
    (queries / "query.jpg").write_bytes(encoded(scene(3), "JPEG"))
    (queries / "plain.png").write_bytes(encoded(scene(3) * 0 + 90))
    (queries / "text.png").write_text("not a picture")
    return queries


@pytest.fixture(scope="module")
def index(pictures):
    index = ShapeIndex(model=TinyEncoder())
    add_folder(index, pictures.parent / "pictures")
    code = index.model.encode([scene(99)])
    index.add(code, names=[NASTY], labels=[NASTY], previews=[encoded(scene(99), "JPEG")])
    return index


@pytest.fixture(scope="module")
def served():
    """Serve applications, each on a port of its own, until the module ends."""
    running = []

    def start(app) -> str:
        listener = socket.socket()
        listener.bind(("127.0.0.1", 0))
        server = uvicorn.Server(uvicorn.Config(app, log_level="error"))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        running.append((server, thread, listener))
        while not server.started:
            time.sleep(0.01)
        return f"http://127.0.0.1:{listener.getsockname()[1]}/"

    yield start
    for server, thread, listener in running:
        server.should_exit = True
        thread.join(20)
        listener.close()


@pytest.fixture(scope="module")
def home(served, index):
    return served(create_app(index, limits=ServiceLimits(upload_bytes=200_000)))


@pytest.fixture
def page(browser, home):
    browser.get_log("browser")
    browser.get(home)
    wait(browser, "document.documentElement.dataset.ready")
    yield browser
    assert [entry for entry in browser.get_log("browser") if entry["level"] in ("SEVERE", "WARNING")] == []


def wait(browser, condition: str, seconds: float = 30) -> None:
    deadline = time.monotonic() + seconds
    while not browser.execute_script(f"return {condition}"):
        assert time.monotonic() < deadline, (
            condition,
            browser.execute_script("return document.body.innerText"),
        )
        time.sleep(0.03)


def by_id(browser, name):
    return browser.find_element("id", name)


def cards(browser) -> list[list[str]]:
    """Return title and small print of every card; also of those that are still appearing."""
    return browser.execute_script(
        "return [...document.querySelectorAll('#results .match')].map((card) =>"
        " ['b', 'small'].map((part) => card.querySelector(part).textContent))"
    )


def shown(count: int) -> str:
    """Say in JavaScript that so many matches are there, with their pictures."""
    return (
        "(() => { const all = [...document.querySelectorAll('#results img')];"
        f" return all.length === {count} && all.every((image) => image.naturalWidth > 0)"
        " && !document.querySelector('#results.waiting') && !document.getElementById('query').hidden; })()"
    )


def choose(browser, path) -> None:
    by_id(browser, "file").send_keys(str(path))


def searched(browser, pictures) -> None:
    choose(browser, pictures / "query.jpg")
    wait(browser, shown(12))


def test_the_page_begins_with_pictures_to_start_from(page):
    assert by_id(page, "about").text == "15 pictures · 3 classes · codes of 64 bits"
    assert len(cards(page)) == 12
    page.find_elements("css selector", ".match")[2].click()
    wait(page, shown(12))
    assert cards(page)[0][1] == "0 of 64 bits apart"


def test_nothing_is_loaded_from_elsewhere(page, home, pictures):
    searched(page, pictures)
    loaded = page.execute_script("return performance.getEntriesByType('resource').map((e) => e.name)")
    assert [name for name in loaded if not name.startswith((home, "blob:" + home, "data:"))] == []


def test_a_picture_that_is_chosen_finds_its_like(page, pictures):
    searched(page, pictures)
    assert cards(page)[0][0] == "green hills"
    distances = [int(small.split()[0]) for _, small in cards(page)]
    assert distances == sorted(distances)
    assert distances[0] == 0
    assert "96 × 72 pixels" in by_id(page, "query-facts").text
    assert " ms" in by_id(page, "told").text
    assert by_id(page, "told").get_attribute("role") == "status"


def test_matches_can_be_kept_to_a_class_and_counted(page, pictures):
    from selenium.webdriver.support.ui import Select

    searched(page, pictures)
    options = [option.text for option in Select(by_id(page, "label")).options]
    assert options[:2] == ["All", f"{NASTY} (1)"]
    Select(by_id(page, "label")).select_by_visible_text("lakes (8)")
    wait(page, shown(8))
    assert {title for title, _ in cards(page)} == {"lakes"}
    Select(by_id(page, "count")).select_by_visible_text("6")
    wait(page, shown(6))
    assert by_id(page, "headline").text == "Nearest pictures"


def test_names_are_text_and_never_markup(page, pictures):
    from selenium.webdriver.support.ui import Select

    searched(page, pictures)
    Select(by_id(page, "label")).select_by_index(1)
    wait(page, shown(1))
    page.find_element("css selector", ".match").click()
    wait(page, "document.getElementById('stage').dataset.ready")
    assert by_id(page, "detail-title").text == NASTY
    assert page.title == "Search by shape"
    by_id(page, "close").click()


def test_a_match_shows_what_it_shares(page, pictures):
    searched(page, pictures)
    page.find_elements("css selector", ".match")[1].click()
    wait(page, "document.getElementById('stage').dataset.ready")
    drawn = page.execute_script(
        "return [...document.querySelectorAll('.pair')].filter((g) => g.style.display !== 'none').length"
    )
    assert str(drawn) == by_id(page, "drawn").text
    assert drawn > 0
    assert "features agree" in by_id(page, "verdict").text
    inside = page.execute_script(
        "const b = board.viewBox.baseVal; return [...board.querySelectorAll('.dot')].every((d) =>"
        " d.cx.baseVal.value >= 0 && d.cx.baseVal.value <= b.width && d.cy.baseVal.value <= b.height)"
    )
    assert inside
    page.execute_script("most.value = 3; most.dispatchEvent(new Event('input'))")
    assert by_id(page, "drawn").text == "3"
    by_id(page, "again").click()
    wait(page, shown(12))
    assert cards(page)[0][1] == "0 of 64 bits apart"


def test_everything_can_be_done_by_keyboard(page, pictures):
    from selenium.webdriver.common.action_chains import ActionChains

    searched(page, pictures)
    page.execute_script("document.body.focus()")
    seen = []
    for _ in range(12):
        ActionChains(page).send_keys(TAB).perform()
        seen.append(page.execute_script("const e = document.activeElement; return e.id || e.className"))
    assert [name for name in seen if name in ("file", "label", "count")] == ["file", "label", "count"]
    first = page.find_elements("css selector", ".match")[0]
    first.send_keys(ENTER)
    wait(page, "document.getElementById('detail').open")
    assert "match 1 of 12" in by_id(page, "detail-facts").text
    page.switch_to.active_element.send_keys(RIGHT)
    wait(page, "document.getElementById('detail-facts').textContent.includes('match 2 of 12')")
    page.switch_to.active_element.send_keys(LEFT)
    wait(page, "document.getElementById('detail-facts').textContent.includes('match 1 of 12')")
    page.switch_to.active_element.send_keys(ESCAPE)
    wait(page, "!document.getElementById('detail').open")
    assert page.execute_script("return document.activeElement.dataset.id") == first.get_attribute("data-id")


def test_whatever_can_be_used_has_a_name(page, pictures):
    searched(page, pictures)
    nameless = page.execute_script(
        """return [...document.querySelectorAll('button, input, select, a, img, svg')].filter((e) => {
          const label = e.id && document.querySelector(`label[for="${e.id}"]`);
          return !(e.ariaLabel || e.textContent.trim() || label || e.title || e.hasAttribute('alt')
            || e.ariaHidden === 'true');
        }).map((e) => e.outerHTML)"""
    )
    assert nameless == []
    assert page.execute_script("return document.documentElement.lang") == "en"
    assert page.execute_script("return document.querySelectorAll('h1').length") == 1


@pytest.mark.parametrize("width", [320, 1600])
def test_the_page_fits_every_width(page, pictures, width):
    page.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": width, "height": 844, "deviceScaleFactor": 1, "mobile": width < 500},
    )
    try:
        searched(page, pictures)
        assert page.execute_script("return document.documentElement.scrollWidth") <= width
        page.find_elements("css selector", ".match")[0].click()
        wait(page, "document.getElementById('stage').dataset.ready")
        box = page.execute_script("const b = detail.getBoundingClientRect(); return [b.left, b.right]")
        assert box[0] >= 0
        assert box[1] <= width
        if width < 500:
            small = page.execute_script(
                "return [...document.querySelectorAll('dialog button, select, .button')]"
                ".filter((e) => e.getBoundingClientRect().height < 44).map((e) => e.outerHTML)"
            )
            assert small == []
        by_id(page, "close").click()
    finally:
        page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def refused(browser, home) -> list[str]:
    """Return what the console holds besides the refusals themselves, which browsers always log."""
    entries = browser.get_log("browser")
    return [
        e["message"] for e in entries if e["level"] == "SEVERE" and "the server responded" not in e["message"]
    ]


@pytest.mark.parametrize(("name", "why"), [("text.png", "not a picture"), ("plain.png", "one colour")])
def test_bad_pictures_are_refused_in_words_and_the_next_one_works(browser, home, pictures, name, why):
    browser.get(home)
    wait(browser, "document.documentElement.dataset.ready")
    choose(browser, pictures / name)
    wait(browser, "!document.getElementById('problem').hidden")
    assert why in by_id(browser, "problem").text
    assert by_id(browser, "problem").get_attribute("role") == "alert"
    searched(browser, pictures)
    assert not by_id(browser, "problem").is_displayed()
    assert refused(browser, home) == []


def test_a_file_that_is_too_large_is_refused_before_it_is_sent(page, tmp_path):
    (tmp_path / "large.jpg").write_bytes(bytes(300_000))
    choose(page, tmp_path / "large.jpg")
    wait(page, "!document.getElementById('problem').hidden")
    assert "0.3 MB; the service takes up to 0.2" in by_id(page, "problem").text


def test_an_empty_index_says_what_to_do(browser, served):
    browser.get(served(create_app(ShapeIndex(model=TinyEncoder()))))
    wait(browser, "document.documentElement.dataset.ready")
    assert "pliant retrieval add" in by_id(browser, "nothing").text
    assert refused(browser, "") == []


def test_a_token_is_asked_for_or_taken_from_the_link(browser, served, index, pictures):
    home = served(create_app(index, token=TOKEN))
    browser.get(home)
    wait(browser, "!document.getElementById('entry').hidden")
    by_id(browser, "token").send_keys("wrong" + ENTER)
    wait(browser, "!document.getElementById('entry-error').hidden")
    assert "The token is missing or wrong." in by_id(browser, "entry-error").text
    by_id(browser, "token").clear()
    by_id(browser, "token").send_keys(TOKEN + ENTER)
    wait(browser, "document.documentElement.dataset.ready")
    searched(browser, pictures)
    browser.execute_script("sessionStorage.clear()")
    browser.get("about:blank")
    browser.get(f"{home}#token={TOKEN}")
    wait(browser, "document.documentElement.dataset.ready")
    assert TOKEN not in browser.current_url
    assert refused(browser, home) == []


def test_the_interface_is_described_for_reading(browser, home):
    browser.get_log("browser")
    browser.get(home + "docs")
    wait(browser, "document.documentElement.dataset.ready")
    text = browser.find_element("tag name", "body").text
    for part in ("/api/query", "multipart/form-data", "integer 1 to 96", "The request is too large."):
        assert part in text
    assert "undefined" not in text
    assert [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"] == []
