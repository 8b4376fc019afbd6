"""``pliant view`` by pixel: a screenshot against the software renderer, symmetries stepped through, the bull's-eye."""

from __future__ import annotations

import io

import numpy as np
import pytest

from pliant import save_arrays, save_mesh, shapes
from pliant.cli import main
from pliant.heart import heart_phantom
from pliant.matching.symmetry import Symmetry, SymmetryResult
from pliant.report.colours import colour_table
from pliant.report.render import interpolate, rasterise

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")
NUMBERS = (0.9, 0.1, 0.01, 1.0, 0.02, 0.8)


@pytest.fixture(scope="module")
def animal():
    return shapes.quadruped(1000)


@pytest.fixture(scope="module")
def heart():
    return heart_phantom(spacing=8.0, mesh_step=4.0, rng=0)


@pytest.fixture(scope="module")
def result(animal):
    """The true mirror, and the part of it that carries the left hind leg to the right."""
    n = animal.mesh.n_vertices
    leg = animal.parts == animal.part_names.index("left hind leg")
    other = np.zeros(n, bool)
    other[animal.symmetry[leg]] = True
    mirror = Symmetry(np.ones(n, bool), np.ones(n, bool), animal.symmetry, np.eye(3), *NUMBERS)
    limbs = Symmetry(leg, other, np.where(leg, animal.symmetry, -1), np.eye(3), *NUMBERS, "partial")
    return SymmetryResult((mirror, limbs), (), {"samples": 100})


@pytest.fixture(scope="module")
def opened(browser, animal, heart, result, tmp_path_factory):
    place = tmp_path_factory.mktemp("view")
    save_mesh(place / "animal.ply", animal.mesh)
    save_arrays(place / "animal.npz", {"height": animal.mesh.vertices[:, 1]})
    result.save(place / "symmetries")
    save_mesh(place / "heart.ply", heart.mesh)
    save_arrays(
        place / "heart.npz", {"height": heart.mesh.vertices[:, 2], "segment": heart.labels.astype(np.int64)}
    )
    names = ("animal.ply", "animal.npz", "symmetries", "heart.ply", "heart.npz")
    page = place / "view.html"
    assert main(["view", *(str(place / name) for name in names), "-o", str(page), "--up", "y"]) == 0
    browser.open(page, (1200, 1700))
    # It opens at the first symmetry, and with one scale for both.
    assert browser.run("return document.getElementById('step').textContent") == "Symmetry 1 (global), 1 of 2"
    assert browser.run("return pliant.panes[0].view.mirrored") is not None
    browser.run("document.getElementById('common').click()")
    return browser


@pytest.fixture
def driver(opened):
    return opened.driver


def screenshot(driver, pane: int) -> np.ndarray:
    """(h, w, 3) what the page shows on the canvas of a pane, from a screenshot of the whole page."""
    from matplotlib.image import imread

    driver.execute_script("window.scrollTo(0, 0); pliant.panes.forEach((p) => p.view.draw())")
    box = driver.execute_script(
        "const b = pliant.panes[arguments[0]].view.canvas.getBoundingClientRect();"
        "return [b.x, b.y, b.width, b.height]",
        pane,
    )
    image = imread(io.BytesIO(driver.get_screenshot_as_png()))[:, :, :3]
    x, y, width, height = (round(value) for value in box)
    return image[y : y + height, x : x + width]


def expected(driver, mesh, values, shape):
    """What the same view must show: where there is surface and which value, by the software renderer."""
    run = driver.execute_script
    rotation = np.array(run("return pliant.panes[0].view.rotation"))
    density, centre, pan = run(
        "const v = pliant.panes[0].view; return [v.density, Array.from(v.centre), v.pan]"
    )
    raster = rasterise(mesh, rotation, pixel=1 / density, samples=1)
    field = interpolate(raster, mesh, values)
    seen = mesh.vertices @ rotation.T
    middle = (seen.min(axis=0) + seen.max(axis=0))[:2] / 2 - (rotation @ np.array(centre))[:2]
    # The raster's middle is that of the shape's extent, the canvas's is the centre of its bounding sphere.
    x = shape[1] / 2 + pan[0] + middle[0] * density - field.shape[1] / 2
    y = shape[0] / 2 + pan[1] - middle[1] * density - field.shape[0] / 2
    whole = np.full(shape[:2], np.nan)
    x, y = round(x), round(y)
    rows, columns = slice(max(y, 0), y + field.shape[0]), slice(max(x, 0), x + field.shape[1])
    inside = field[max(-y, 0) :, max(-x, 0) :]
    whole[rows, columns] = inside[: whole[rows, columns].shape[0], : whole[rows, columns].shape[1]]
    return whole


def test_the_screenshot_is_what_the_software_renderer_draws(driver, animal):
    driver.execute_script("pliant.look('left'); pliant.panes[0].view.turn(0.4, 0.2)")
    height = animal.mesh.vertices[:, 1]
    image = screenshot(driver, 0)
    values = expected(driver, animal.mesh, height, image.shape)
    drawn, wanted = image.min(axis=2) < 0.93, np.isfinite(values)
    # The ruler lies in a corner of the canvas.
    drawn[-60:] = wanted[-60:] = False
    assert wanted.sum() > 20_000
    assert (drawn & wanted).sum() / (drawn | wanted).sum() > 0.97
    # Light changes how bright a colour is, not which one: compare the shares of red, green and blue.
    low, high = driver.execute_script("return pliant.limits(pliant.panes[0], 'height', false)")
    shares = np.clip(np.rint(255 * (values[drawn & wanted] - low) / (high - low)), 0, 255)
    colours = (colour_table("viridis") / 255.0)[shares.astype(int)]
    found = image[drawn & wanted]
    apart = np.abs(found / found.sum(axis=1, keepdims=True) - colours / colours.sum(axis=1, keepdims=True))
    assert np.quantile(apart.max(axis=1), 0.95) < 0.04


def test_a_step_marks_a_vertex_and_its_mirror_image(driver, animal):
    run = driver.execute_script
    run("pliant.panes[0].lookAlong(0)")
    run("pliant.map = null; pliant.panes[0].picked = null; pliant.panes[0].view.mark(null)")
    before = screenshot(driver, 0)
    driver.find_element("id", "next").click()
    assert driver.find_element("id", "step").text == "Symmetry 1 (global), 1 of 2"
    marked, image = run("return [pliant.panes[0].view.marked, pliant.panes[0].view.mirrored]")
    assert animal.symmetry[marked] == image
    gaps = np.linalg.norm(animal.mesh.vertices - animal.mesh.vertices[animal.symmetry], axis=1)
    assert gaps[marked] > 0.95 * gaps.max()  # the farthest of those that face the viewer at both ends
    after = screenshot(driver, 0)
    for vertex in (marked, image):
        x, y, _ = run("return pliant.panes[0].view.project(arguments[0])", int(vertex))
        spot = np.s_[round(y) - 1 : round(y) + 2, round(x) - 1 : round(x) + 2]
        assert (after[spot][..., 0] - after[spot][..., 1]).mean() > (
            before[spot][..., 0] - before[spot][..., 1]
        ).mean() + 0.15
    # Far from both nothing changed.
    assert (np.abs(after - before).max(axis=2) > 0.02).mean() < 0.01


def test_the_next_step_moves_to_where_the_map_goes(driver, animal, result):
    run = driver.execute_script
    run("pliant.map = 0")
    outside = int(np.flatnonzero(result.symmetries[1].point_map < 0)[0])
    run("pliant.pick(pliant.panes[0], arguments[0])", outside)
    driver.find_element("id", "next").click()
    assert driver.find_element("id", "step").text == "Symmetry 2 (partial), 2 of 2"
    marked, image = run("return [pliant.panes[0].view.marked, pliant.panes[0].view.mirrored]")
    assert result.symmetries[1].point_map[marked] == image
    driver.find_element("id", "next").click()
    assert driver.find_element("id", "step").text == "none"
    assert run("return pliant.panes[0].view.mirrored") is None


def test_the_bulls_eye_has_the_ventricles_colours(driver, heart):
    run = driver.execute_script
    run(
        "const c = document.getElementById('layer'); c.value = 'height'; c.dispatchEvent(new Event('change'))"
    )
    height, labels = heart.mesh.vertices[:, 2].astype("f4"), heart.labels
    low, high = run("return pliant.limits(pliant.panes[1], 'height', false)")
    table = colour_table("viridis")
    parts = driver.find_elements(
        "css selector", "[data-pane='1'] .bullseye path, [data-pane='1'] .bullseye circle"
    )
    assert len(parts) == 17
    for part in parts:
        segment = int(
            part.find_element("css selector", "title").get_attribute("textContent").split(":")[0].split()[1]
        )
        mean = height[labels == segment].astype(float).mean()
        colour = table[int(np.clip(round(255 * (mean - low) / (high - low)), 0, 255))].astype(int)
        found = list(bytes.fromhex(part.get_attribute("fill")[1:]))
        np.testing.assert_allclose(found, colour, atol=3)
    seventh = next(p for p in parts if "Segment 7:" in p.get_attribute("innerHTML"))
    run("arguments[0].dispatchEvent(new MouseEvent('click', {bubbles: true}))", seventh)
    assert labels[run("return pliant.panes[1].view.marked")] == 7
    assert "AHA segment7" in run("return pliant.panes[1].place.querySelector('.readout').textContent")


def test_the_bulls_eye_stands_beside_its_own_ventricle_only(driver):
    shown = driver.execute_script(
        "return pliant.panes.map((p) => !p.place.querySelector('.bullseye').hidden)"
    )
    assert shown == [False, True]


def test_nothing_went_wrong(opened):
    assert opened.errors() == []
