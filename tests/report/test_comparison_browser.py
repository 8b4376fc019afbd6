"""The page of several surfaces in a browser: picking, linked cameras, mirror images, a bull's-eye, no error."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from scipy.spatial import KDTree

from pliant import InputError, ShownSurface, comparison_page, save_arrays, save_mesh, shapes
from pliant.cli import main
from pliant.report import render, write_page


def test_what_does_not_fit_is_refused():
    ball = shapes.icosphere(1)
    layers = {"height": ball.vertices[:, 2]}
    with pytest.raises(InputError, match="at least one"):
        comparison_page([], title="none")
    with pytest.raises(InputError, match="different names"):
        comparison_page([ShownSurface("a", ball, layers)] * 2, title="twice")
    segments = np.r_[18, 19, np.zeros(ball.n_vertices - 2)].astype(int)
    with pytest.raises(InputError, match="2 numbers do not"):
        comparison_page([ShownSurface("a", ball, layers, segments=segments)], title="18")
    with pytest.raises(InputError, match="one number a vertex"):
        comparison_page([ShownSurface("a", ball, layers, maps={"m": [0, 1]})], title="short")


def test_results_need_a_mesh_before_them(tmp_path, capsys):
    save_arrays(tmp_path / "x.npz", {"a": np.zeros(3)})
    assert main(["view", str(tmp_path / "x.npz"), "-o", str(tmp_path / "v.html")]) == 3
    assert "name the mesh" in capsys.readouterr().err
    assert main(["view", str(tmp_path / "none.ply"), "-o", str(tmp_path / "v.html")]) == 3


@pytest.fixture
def page(tmp_path, capsys):
    """A ball with 17 segments and an array of rows, and a copy that is stretched, written and viewed by the command."""
    ball = shapes.icosphere(3)
    segments = np.arange(ball.n_vertices) % 18
    save_mesh(tmp_path / "ball.ply", ball)
    save_mesh(tmp_path / "egg.ply", ball.scaled(2.0))
    arrays = {
        "segment": segments,
        "height": ball.vertices[:, 2],
        "rows": np.random.default_rng(0).random((642, 4)),
    }
    save_arrays(tmp_path / "ball.npz", arrays)
    save_arrays(tmp_path / "egg.npz", {"height": 2 * ball.vertices[:, 2], "wrong": np.zeros(5)})
    files = [str(tmp_path / name) for name in ("ball.ply", "ball.npz", "egg.ply", "egg.npz")]
    assert main(["view", *files, "-o", str(tmp_path / "view.html")]) == 0
    assert "egg.npz: wrong has length 5" in capsys.readouterr().err
    return tmp_path / "view.html"


def test_the_page_loads_nothing(page):
    text = page.read_text(encoding="utf-8")
    assert "https:" not in text
    assert 'src="' not in text


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_two_surfaces_side_by_side(browser, page):
    run = browser.open(page, (1200, 1000)).run
    run("pliant.pick(pliant.panes[0], 7)")
    assert run("return pliant.panes.map((pane) => pane.view.marked)") == [7, 7]
    assert "AHA segment" in run("return pliant.panes[0].place.querySelector('.readout').textContent")
    assert run("return document.querySelectorAll('.bullseye:not([hidden]) path').length") == 16
    # Turning one turns the other; they stay as large on their own canvas as they were.
    run("pliant.panes[0].view.turn(0.3, 0.2); pliant.panes[0].view.zoomBy(1.5); pliant.panes[0].view.draw()")
    rotations = json.loads(run("return JSON.stringify(pliant.panes.map((p) => p.view.rotation))"))
    assert rotations[0] == rotations[1]
    assert run("return pliant.panes.map((p) => p.view.enlarged)") == [1.5, 1.5]
    # The egg has no segments: it says so, and is grey.
    browser.choose("layer", "segment")
    assert "no values called segment" in run("return pliant.panes[1].place.textContent")
    # Whole numbers of a file are labels: 17 segments by their names, and what is in none.
    names = run(
        "return [...document.querySelectorAll('.legend .label-name')].map((name) => name.textContent)"
    )
    assert names[:2] == ["0 no segment", "1 basal anterior"]
    assert len(names) == 18
    browser.wide(390, 844)
    assert run("return document.documentElement.scrollWidth") == 390
    assert browser.errors() == []


def test_a_step_shows_a_vertex_and_its_image_from_the_maps_own_side(browser, tmp_path):
    ball = shapes.icosphere(3)
    # Mirror images across x and across z; both ends of either are seen from the front, or from the right.
    tree = KDTree(ball.vertices)
    maps = {
        name: tree.query(ball.vertices * sign)[1] for name, sign in (("x", [-1, 1, 1]), ("z", [1, 1, -1]))
    }
    cameras = {"x": render.camera("top"), "z": render.camera("right")}
    layers = {
        "height": ball.vertices[:, 2],
        "x": np.abs(ball.vertices[:, 0]),
        "z": np.abs(ball.vertices[:, 2]),
    }
    shown = ShownSurface("ball", ball, layers, maps=maps, cameras=cameras)
    with pytest.raises(InputError, match="camera of map 'x'"):
        comparison_page(
            [ShownSurface("b", ball, layers, maps=maps, cameras={"x": np.ones((3, 3))})], title="b"
        )
    opened = browser.open(write_page(tmp_path / "page.html", comparison_page([shown], title="Ball")))
    state = """const { view } = pliant.panes[0], at = (v) => Array.from(view.normals.subarray(3 * v, 3 * v + 3));
    return [document.getElementById('layer').value, view.rotation,
            [view.marked, view.mirrored].map((v) => dot(view.rotation[2], at(v)))]"""
    for name in ("x", "z"):
        layer, rotation, facing = opened.run(state)
        assert layer == name
        np.testing.assert_allclose(rotation, cameras[name], atol=1e-12)
        assert min(facing) > 0.1
        # Colours that join points with their images have no numbers.
        assert "have one colour" in opened.run("return document.querySelector('.key').textContent")
        assert opened.run("return document.querySelector('.key-bar')") is None
        rows = opened.run("return [...document.querySelectorAll('.readout th')].map((th) => th.textContent)")
        assert rows == ["Vertex", name, "height"]
        opened.driver.find_element("id", "next").click()
    # A layer and a vertex that were chosen by hand stay.
    opened.choose("layer", "height")
    picked = int(np.argmax(ball.vertices @ [1, 1, 1]))
    opened.run("pliant.pick(pliant.panes[0], arguments[0])", picked)
    opened.driver.find_element("id", "next").click()
    assert opened.run(state)[0] == "height"
    assert opened.run("return pliant.panes[0].view.mirrored") == maps["x"][picked]
    assert opened.errors() == []


def test_a_mesh_alone_is_coloured_by_height_along_what_is_up(tmp_path):
    egg = shapes.ellipsoid((1.0, 2.0, 3.0), 2)
    save_mesh(tmp_path / "egg.ply", egg)
    page = tmp_path / "view.html"
    for up, axis in (("y", 1), ("z", 2)):
        assert main(["view", str(tmp_path / "egg.ply"), "-o", str(page), "--up", up, "--unit", "mm"]) == 0
        text = page.read_text(encoding="utf-8")
        data = json.loads(re.search(r'id="surfaces">(.*?)</script>', text, re.S).group(1))
        (layer,) = data[0]["layers"]
        assert layer["name"] == "height of vertices (mm)"
        low, high = np.percentile(egg.vertices[:, axis].astype("f4"), (2, 98))
        np.testing.assert_allclose([layer["low"], layer["high"]], [low, high], rtol=1e-5)
