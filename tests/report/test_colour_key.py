"""What colours mean, in a browser: legends of labels, bars of values, two surfaces within their frames."""

from __future__ import annotations

import numpy as np
import pytest

from pliant import ShownSurface, comparison_page, shapes, surface_page
from pliant.report import write_page
from pliant.report.labels import LABEL_COLOURS

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")
SIZES = [(1280, 800), (820, 1100), (390, 844)]


@pytest.fixture(scope="module")
def mesh():
    return shapes.ellipsoid((60.0, 40.0, 20.0), 4)


@pytest.fixture(scope="module")
def halves(mesh):
    """Two labels that part at x = 0; a tenth of the vertices above have none."""
    labels = np.where(mesh.vertices[:, 0] > 0, 9.0, 4.0)
    labels[mesh.vertices[:, 2] > 18] = np.nan
    return labels


@pytest.fixture(scope="module")
def heavy(mesh):
    """A field with one value in a thousand far out."""
    field = mesh.vertices[:, 1].copy()
    field[7] = 1e4
    return field


@pytest.fixture(scope="module")
def opened(browser, mesh, halves, heavy, tmp_path_factory):
    segments = 1 + np.arange(mesh.n_vertices) % 17
    layers = {"part": halves, "heavy (mm)": heavy, "segment": segments}
    html = surface_page(
        mesh, layers, title="Parts", length_unit="mm", label_names={"part": {4: "left", 9: "right"}}
    )
    return browser.open(write_page(tmp_path_factory.mktemp("key") / "page.html", html))


def hues(image: np.ndarray) -> np.ndarray:
    """Shares of red, green and blue where there is surface: light does not change them."""
    flat = image.reshape(-1, 3)
    flat = flat[flat.min(axis=1) < 235]
    return flat / flat.sum(axis=1, keepdims=True)


def share(colour: str) -> np.ndarray:
    parts = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)], float)
    return parts / parts.sum()


def legend(run) -> list[list[str]]:
    return run(
        "return [...document.querySelectorAll('#key .legend button')].map((b) => [b.querySelector('.label-name')"
        ".textContent, b.querySelector('.label-count').textContent, b.querySelector('.swatch').style.background])"
    )


def test_a_legend_names_each_label_with_its_count(opened, halves):
    opened.choose("layer", "0")
    rows = legend(opened.run)
    counts = [int((halves == value).sum()) for value in (4, 9)]
    assert [row[:2] for row in rows] == [["left", str(counts[0])], ["right", str(counts[1])]]
    rgb = [f"rgb({', '.join(str(int(c[i : i + 2], 16)) for i in (1, 3, 5))})" for c in LABEL_COLOURS[:2]]
    assert [row[2] for row in rows] == rgb
    missing = opened.run("return document.querySelector('#key .key-missing').textContent")
    assert missing == f"Grey: no value at {np.isnan(halves).sum()} of {halves.size} vertices."
    assert not opened.driver.find_element("id", "map").is_displayed()


def test_labels_have_their_own_colours_and_nothing_between(opened):
    opened.choose("layer", "0")
    opened.run("pliant.page.look('front')")
    seen = hues(opened.picture())
    known = np.array([share(c) for c in (*LABEL_COLOURS[:2], "#b8b8b8")])
    apart = np.linalg.norm(seen[:, None] - known[None], axis=2)
    assert all((apart.argmin(axis=1) == i).mean() > 0.05 for i in range(2))
    # All but the smoothed outline and the line where two labels meet is one of the three colours.
    assert (apart.min(axis=1) < 0.03).mean() > 0.985


def test_choosing_a_label_makes_the_others_pale(opened):
    opened.choose("layer", "0")
    opened.run("pliant.page.look('front')")
    amounts = []
    for _ in range(2):
        opened.driver.find_element("css selector", "[data-label='9']").send_keys("\ue007")  # Enter
        seen = hues(opened.picture())
        near = [(np.linalg.norm(seen - share(c), axis=1) < 0.05).mean() for c in LABEL_COLOURS[:2]]
        amounts.append(near)
        focused = opened.run("return document.activeElement.dataset.label")
        assert focused == "9"  # keys go on from where they were
    assert amounts[0][0] < 0.02 < 0.3 < amounts[0][1]  # the other is pale
    assert amounts[1][0] > 0.3  # chosen again: all are back
    pressed = "return document.querySelector(\"[data-label='9']\").getAttribute('aria-pressed')"
    assert opened.run(pressed) == "false"


def test_segments_of_the_heart_have_their_names(opened):
    opened.choose("layer", "2")
    rows = legend(opened.run)
    assert len(rows) == 17
    assert rows[0][0] == "1 basal anterior"
    assert len({row[2] for row in rows}) == 17
    opened.run("pliant.page.select(3)")
    assert "4 basal inferior" in opened.run("return document.getElementById('readout').textContent")


def test_a_bar_says_its_numbers_and_what_is_clipped(opened, heavy):
    opened.choose("layer", "1")
    low, high = np.percentile(heavy, (2, 98))
    ticks = opened.run(
        "return [...document.querySelectorAll('#key .key-ticks span')].map((s) => s.textContent)"
    )
    found = [float(tick.replace("−", "-")) for tick in ticks]
    np.testing.assert_allclose(found, [low, (low + high) / 2, high], rtol=1e-3, atol=1e-3)
    assert opened.run("return document.querySelector('#key .key-name').textContent") == "heavy (mm)"
    told = opened.run("return document.querySelector('#key .key-clipped').textContent")
    below, above = int((heavy < low).sum()), int((heavy > high).sum())
    assert f"{below} ({100 * below / heavy.size:.1f} %) vertices lie below, {above} (" in told
    assert "to 10000." in told
    # Limits that hold every value clip nothing, and nothing is said.
    for name, value in (("low", "-100"), ("high", "20000")):
        opened.choose(name, value)
    assert opened.run("return document.querySelector('#key .key-clipped')") is None


@pytest.fixture(scope="module")
def pair(browser, mesh, halves, tmp_path_factory):
    """A wide and a tall ellipsoid; they share a field and labels, of which each has one that the other has not."""
    tall = shapes.ellipsoid((20.0, 15.0, 60.0), 4)
    # Away from the axes, where the corners of the bounding box are not the ends of the shape.
    turned = tall.with_vertices(tall.vertices @ _about_x(0.7).T)
    a = ShownSurface(
        "wide", mesh, {"height": mesh.vertices[:, 2], "part": np.where(mesh.vertices[:, 0] > 0, 1, 2)}
    )
    b = ShownSurface(
        "tall", turned, {"height": turned.vertices[:, 2], "part": np.where(turned.vertices[:, 0] > 0, 2, 3)}
    )
    html = comparison_page([a, b], title="Two")
    return lambda: browser.open(write_page(tmp_path_factory.mktemp("pair") / "page.html", html))


def _about_x(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]])


INSIDE = """return pliant.panes.map(({ view }) => {
  const { clientWidth: w, clientHeight: h } = view.canvas;
  let low = [Infinity, Infinity], high = [-Infinity, -Infinity];
  for (let i = 0; i < view.positions.length / 3; i++) {
    const p = view.project(i);
    for (const k of [0, 1]) { low[k] = Math.min(low[k], p[k]); high[k] = Math.max(high[k], p[k]); }
  }
  return [low[0] / w, low[1] / h, high[0] / w, high[1] / h];
})"""


@pytest.mark.parametrize("size", SIZES)
def test_both_shapes_lie_within_their_frames_however_they_are_turned(pair, size):
    opened = pair()
    opened.wide(*size)
    for move in (
        "",
        "pliant.look('left');",
        "pliant.look('top');",
        *["pliant.panes[0].view.turn(0.4, 0.3);"] * 6,
    ):
        opened.run(move + "pliant.panes[0].view.draw()")
        boxes = np.array(opened.run(INSIDE))
        assert boxes[:, :2].min() > 0.01, (move, boxes)
        assert boxes[:, 2:].max() < 0.99, (move, boxes)
    # They still fill them: each reached 92 % of the side that limits it before it was turned.
    opened.run("pliant.look('front')")
    boxes = np.array(opened.run(INSIDE))
    np.testing.assert_allclose((boxes[:, 2:] - boxes[:, :2]).max(axis=1), 0.92, atol=0.02)
    opened.wide(1280, 800)


def test_a_page_made_narrower_keeps_both_in_view(pair):
    opened = pair()
    opened.wide(1280, 800)
    opened.wide(390, 844)
    boxes = np.array(opened.run(INSIDE))
    assert boxes[:, :2].min() > 0.01
    assert boxes[:, 2:].max() < 0.99


def test_numbers_of_a_bar_do_not_touch_on_a_phone(browser, tmp_path):
    ball = shapes.icosphere(3)
    small = 0.0012345678 * (2 + ball.vertices[:, 2])
    shown = [ShownSurface(name, ball, {"small": small}) for name in "ab"]
    opened = browser.open(write_page(tmp_path / "page.html", comparison_page(shown, title="Two")))
    opened.wide(390, 844)
    edges = opened.run(
        """return [...document.querySelector('.key-ticks').children].map((span) => {
          const range = document.createRange(); range.selectNodeContents(span);
          const box = range.getBoundingClientRect(); return [box.left, box.right]; })"""
    )
    assert edges[0][1] + 3 < edges[1][0]
    assert edges[1][1] + 3 < edges[2][0]
    opened.wide(1280, 800)


def test_the_same_scale_is_a_switch(pair):
    opened = pair()
    ticks = "return pliant.panes.map((p) => [...p.place.querySelectorAll('.key-ticks span')].map((s) => s.textContent))"
    same = opened.run(ticks)
    assert same[0] == same[1]
    opened.driver.find_element("id", "common").click()
    own = opened.run(ticks)
    assert own[0] != own[1]


def test_one_label_has_one_colour_and_is_highlighted_on_both(pair):
    opened = pair()
    opened.choose("layer", "part")
    rows = """return pliant.panes.map((p) => [...p.place.querySelectorAll('.legend button')].map((b) =>
      [b.dataset.label, b.querySelector('.swatch').style.background, b.getAttribute('aria-pressed')]))"""
    first, second = opened.run(rows)
    assert [row[0] for row in first] == ["1", "2"]
    assert [row[0] for row in second] == ["2", "3"]
    assert first[1][1] == second[0][1]
    opened.run("pliant.panes[0].place.querySelector(\"[data-label='2']\").click()")
    pressed = [[row[2] for row in rows] for rows in opened.run(rows)]
    assert pressed == [["false", "true"], ["true", "false"]]
    assert opened.errors() == []


def test_one_value_everywhere_has_one_number(browser, mesh, tmp_path):
    ones = {"one": np.ones(mesh.n_vertices)}
    ticks = "return [...document.querySelectorAll('.key-ticks span')].map((s) => s.textContent)"
    opened = browser.open(write_page(tmp_path / "page.html", surface_page(mesh, ones, title="One")))
    assert opened.run(ticks) == ["1"]
    opened.choose("high", "3")  # limits that were typed are shown
    assert opened.run(ticks) == ["1", "2", "3"]
    twos = {"one": np.full(mesh.n_vertices, 2.0)}
    shown = [ShownSurface("a", mesh, ones), ShownSurface("b", mesh, twos)]
    opened = browser.open(write_page(tmp_path / "pair.html", comparison_page(shown, title="Two")))
    assert opened.run(ticks) == ["1", "1.5", "2"] * 2
    opened.driver.find_element("id", "common").click()
    assert opened.run(ticks) == ["1", "2"]


def test_a_label_chosen_on_segments_is_not_another_surfaces_number(browser, mesh, tmp_path):
    number = np.arange(mesh.n_vertices)
    shown = [ShownSurface("heart", mesh, {"id": number % 18}), ShownSurface("wall", mesh, {"id": number % 3})]
    opened = browser.open(write_page(tmp_path / "page.html", comparison_page(shown, title="Two")))
    opened.run("pliant.panes[0].place.querySelector(\"[data-label='1']\").click()")
    pressed = "return pliant.panes.map((p) => p.place.querySelector(\"[data-label='1']\").getAttribute('aria-pressed'))"
    assert opened.run(pressed) == ["true", "false"]
    assert opened.errors() == []


def test_a_long_name_wraps_on_a_phone(browser, mesh, tmp_path):
    name = "LV_4396_vertices_with_aha_segments_and_more_of_a_name_without_any_space.vtk"
    shown = [ShownSurface(name, mesh, {"height": mesh.vertices[:, 2]})]
    for html in (comparison_page(shown, title=name), surface_page(mesh, shown[0].layers, title=name)):
        opened = browser.open(write_page(tmp_path / "page.html", html))
        opened.wide(390, 844)
        assert opened.run("return document.documentElement.scrollWidth") == 390
    opened.wide(1280, 800)
