"""The interactive page in a real browser: it draws, and what is picked is what is under the pointer."""

from __future__ import annotations

import numpy as np
import pytest

from pliant import Mesh, shapes
from pliant.report import surface_page, write_page

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")


@pytest.fixture(scope="module")
def mesh() -> Mesh:
    return shapes.ellipsoid((60.0, 80.0, 40.0), 4)


@pytest.fixture(scope="module")
def opened(browser, mesh, tmp_path_factory):
    field = mesh.vertices[:, 2].copy()
    field[field > 35] = np.nan
    counts = np.random.default_rng(0).integers(0, 9, (mesh.n_vertices, 5))
    html = surface_page(
        mesh,
        {"height (mm)": field, "y": mesh.vertices[:, 1], "size": np.exp(mesh.vertices[:, 0] / 20)},
        title="An ellipsoid & its <height>",
        histograms={"counts": counts},
        edges=np.linspace(0, 1, 6),
        length_unit="mm",
    )
    browser.open(write_page(tmp_path_factory.mktemp("page") / "page.html", html))
    browser.driver.counts = counts
    return browser.driver


def by_id(browser, name):
    return browser.find_element("id", name)


def click_at(browser, x: float, y: float) -> None:
    """Click the canvas, (x, y) from its upper left corner in CSS pixels."""
    from selenium.webdriver.common.action_chains import ActionChains

    canvas = by_id(browser, "canvas")
    browser.execute_script("window.scrollTo(0, 0)")
    size = canvas.size
    ActionChains(browser).move_to_element_with_offset(
        canvas, round(x - size["width"] / 2), round(y - size["height"] / 2)
    ).click().perform()


def look(browser, side: str) -> None:
    browser.find_element("css selector", f"[data-side={side}]").click()


def readout(browser) -> dict[str, str]:
    rows = browser.find_elements("css selector", "#readout tr")
    return {row.find_element("tag name", "th").text: row.find_element("tag name", "td").text for row in rows}


def pixel(browser, x: float, y: float) -> list[int]:
    return browser.execute_script(
        """const {gl, canvas} = pliant.view, out = new Uint8Array(4), r = canvas.width / canvas.clientWidth;
        const [x, y] = [arguments[0] * r, canvas.height - arguments[1] * r];
        pliant.view.draw();
        gl.readPixels(x, y, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, out);
        return Array.from(out);""",
        x,
        y,
    )


def test_nothing_goes_wrong_and_nothing_is_fetched(opened):
    assert [entry for entry in opened.get_log("browser") if entry["level"] == "SEVERE"] == []
    fetched = opened.execute_script("return performance.getEntriesByType('resource').map((e) => e.name)")
    assert [name for name in fetched if not name.startswith(("data:", "blob:"))] == []
    assert opened.title == "An ellipsoid & its <height>"
    assert not by_id(opened, "loading").is_displayed()


# Image right, image up, towards the viewer as signed axes of the mesh, independently of the library.
AXES = {"left": (-2, 3, -1), "right": (2, 3, 1), "front": (-1, 3, 2), "top": (1, 2, 3), "bottom": (-1, 2, -3)}


@pytest.mark.parametrize("side", AXES)
@pytest.mark.parametrize("spot", [(0.0, 0.0), (0.4, 0.3), (-0.55, 0.2), (0.1, -0.6)])
def test_the_vertex_under_the_pointer_is_picked(opened, mesh, side, spot):
    """The place clicked is worked out here from the page's scale; the nearest front vertex is wanted."""
    look(opened, side)
    density = opened.execute_script("return pliant.view.density")
    seen = np.column_stack([np.sign(a) * mesh.vertices[:, abs(a) - 1] for a in AXES[side]])
    half = seen.max(axis=0)
    canvas = by_id(opened, "canvas").size
    x = round(canvas["width"] / 2 + spot[0] * half[0] * density)
    y = round(canvas["height"] / 2 - spot[1] * half[1] * density)
    click_at(opened, x, y)
    shown = readout(opened)
    picked = int(shown["Vertex"])
    clicked = np.array([(x - canvas["width"] / 2) / density, (canvas["height"] / 2 - y) / density])
    distances = np.where(seen[:, 2] > 0, np.linalg.norm(seen[:, :2] - clicked, axis=1), np.inf)
    assert distances[picked] <= distances.min() + 1.5 / density  # a pixel and a half for rounding
    assert seen[picked, 2] > 0
    position = [float(part) for part in shown["Position (mm)"].replace("−", "-").split(",")]
    assert np.allclose(position, mesh.vertices[picked], atol=0.01)


def test_a_click_beside_the_shape_changes_nothing(opened):
    look(opened, "top")
    click_at(opened, by_id(opened, "canvas").size["width"] / 2, by_id(opened, "canvas").size["height"] / 2)
    before = readout(opened)
    click_at(opened, 6, 6)
    assert readout(opened) == before


def test_a_number_typed_shows_that_vertex_facing_the_viewer(opened, mesh):
    field = by_id(opened, "vertex")
    field.clear()
    field.send_keys("123\n")
    shown = readout(opened)
    assert shown["Vertex"] == "123"
    value = float(shown["y"].split("\n")[0].replace("−", "-"))
    assert value == pytest.approx(mesh.vertices[123, 1], rel=1e-4)
    below = 100 * np.mean(mesh.vertices[:, 1].astype("f4") < mesh.vertices[123, 1].astype("f4"))
    assert shown["y"].endswith(f"percentile {below:.1f}")
    x, y, depth = opened.execute_script("return pliant.view.project(123)")
    assert depth > 0
    click_at(opened, x, y)
    assert readout(opened)["Vertex"] == "123"


def test_the_histogram_of_the_vertex_is_drawn(opened):
    opened.execute_script("pliant.page.select(7)")
    heights = [
        float(bar.get_attribute("height")) for bar in opened.find_elements("css selector", "#histograms .bar")
    ]
    counts = opened.counts[7]
    assert np.allclose(heights, 82 * counts / counts.max(), atol=1e-6)


@pytest.mark.parametrize("text", ["-1", "2562", "1.5", "", "e"])
def test_a_wrong_number_is_refused_in_words(opened, text):
    opened.execute_script("pliant.page.select(7)")
    field = by_id(opened, "vertex")
    field.clear()
    field.send_keys(text + "\n")
    assert by_id(opened, "vertex-error").is_displayed()
    assert readout(opened)["Vertex"] == "7"


def test_missing_values_are_grey_and_others_coloured(opened):
    opened.execute_script("pliant.view.mark(null)")
    canvas = by_id(opened, "canvas").size
    look(opened, "top")
    red, green, blue, _ = pixel(opened, canvas["width"] / 2, canvas["height"] / 2)
    assert red == green == blue
    look(opened, "bottom")
    red, green, blue, _ = pixel(opened, canvas["width"] / 2, canvas["height"] / 2)
    assert np.allclose(
        np.array([red, green, blue]) / blue, np.array([68, 1, 84]) / 84, atol=0.05
    )  # viridis, 0


def test_keys_turn_the_surface_and_0_brings_it_back(opened):
    look(opened, "left")
    before = opened.execute_script("return pliant.view.rotation")
    canvas = by_id(opened, "canvas")
    for _ in range(9):
        canvas.send_keys("\ue014")  # right arrow: nine times ten degrees
    quarter = np.array(opened.execute_script("return pliant.view.rotation"))
    # The front follows the pointer: what was at the viewer's left is now in front.
    assert np.allclose(quarter[2], -np.array(before[0]), atol=1e-9)
    assert np.allclose(quarter @ quarter.T, np.eye(3), atol=1e-9)
    canvas.send_keys("0")
    assert np.allclose(opened.execute_script("return pliant.view.rotation"), before)


def test_dragging_turns_and_does_not_pick(opened):
    from selenium.webdriver.common.action_chains import ActionChains

    look(opened, "front")
    opened.execute_script("pliant.page.select(7)")
    before = np.array(opened.execute_script("return pliant.view.rotation"))
    canvas = by_id(opened, "canvas")
    ActionChains(opened).move_to_element(canvas).click_and_hold().move_by_offset(60, 10).release().perform()
    after = np.array(opened.execute_script("return pliant.view.rotation"))
    assert not np.allclose(before, after)
    assert np.allclose(after @ after.T, np.eye(3), atol=1e-9)
    assert readout(opened)["Vertex"] == "7"


def test_zooming_keeps_the_point_under_the_pointer(opened):
    look(opened, "right")
    spots = opened.execute_script(
        "const v = pliant.view, a = v.project(40); v.zoomBy(2, a[0], a[1]); return [a, v.project(40)]"
    )
    assert np.allclose(spots[0], spots[1])


def test_layers_scales_and_limits_can_be_chosen(opened):
    from selenium.webdriver.support.ui import Select

    Select(by_id(opened, "layer")).select_by_visible_text("size")
    Select(by_id(opened, "scale")).select_by_value("log")
    ticks = [span.text for span in opened.find_elements("css selector", ".key-ticks span")]
    low, middle, high = (float(tick) for tick in ticks)
    assert middle == pytest.approx(np.sqrt(low * high), rel=1e-3)
    field = by_id(opened, "low")
    field.clear()
    field.send_keys("-4\t")
    assert by_id(opened, "limits-error").is_displayed()
    by_id(opened, "reset-limits").click()
    assert not by_id(opened, "limits-error").is_displayed()
    Select(by_id(opened, "layer")).select_by_visible_text("height (mm)")
    assert by_id(opened, "scale").get_attribute("value") == "linear"  # it has values below 0
    assert "no value" in by_id(opened, "key").text


def test_the_page_fits_a_phone(opened):
    opened.execute_cdp_cmd(
        "Emulation.setDeviceMetricsOverride",
        {"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": True},
    )
    assert opened.execute_script("return document.documentElement.scrollWidth") == 390
    opened.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
