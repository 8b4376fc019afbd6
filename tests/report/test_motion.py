"""Turning a large surface: fewer pixels and triangles while it moves where frames are slow, all of them at rest."""

from __future__ import annotations

import time

import numpy as np
import pytest

from pliant import shapes, surface_page
from pliant.report import write_page

pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning")

LEARN = """const motion = new Motion(null, () => {});
for (const [time, moving] of arguments[0]) motion.learn(time, moving);
return motion.level;"""


@pytest.fixture(scope="module")
def opened(browser, tmp_path_factory):
    ball = shapes.icosphere(5)  # 20,480 triangles
    x, y, _ = ball.vertices.T
    wrinkled = 1 + 0.04 * np.sin(25 * x) * np.sin(25 * y + 1)
    ball = ball.with_vertices(ball.vertices * wrinkled[:, None] * (60.0, 40.0, 30.0))
    layers = {"height": ball.vertices[:, 2], "part": (ball.vertices[:, 0] > 0).astype(int)}
    html = surface_page(ball, layers, title="large")
    return browser.open(write_page(tmp_path_factory.mktemp("motion") / "page.html", html))


@pytest.mark.parametrize(
    ("frames", "level"),
    [
        ([(16, True)] * 40, 0),
        ([(600, False)], 0),  # the first frame waits for shaders
        ([(600, True), (16, True), (600, True), (16, True)], 0),
        ([(80, True)] * 2, 1),
        ([(80, True)] * 4, 2),
        ([(600, True)] * 2, 2),
        ([(600, True)] * 9, 2),
        ([(600, False)] * 2, 2),
        ([(600, True)] * 2 + [(600, False)] * 3, 2),
        ([(600, True)] * 2 + [(16, False)], 0),  # a whole frame was fast: the machine was busy before
    ],
)
def test_detail_is_lowered_by_slow_frames_only_and_comes_back(opened, frames, level):
    assert opened.run(LEARN, frames) == level


@pytest.mark.parametrize("layer", ["0", "1"])
def test_the_coarse_picture_is_the_same_but_for_detail(opened, layer):
    run = opened.run
    opened.choose("layer", layer)
    run("pliant.page.look('front'); pliant.view.turn(0.5, 0.3)")
    full, coarse = opened.picture(), opened.picture("view.draw(DETAILS[2])")
    assert abs(2 * coarse.shape[1] - full.shape[1]) <= 2
    triangles = run("return [pliant.view.coarse.faces.length / 3, pliant.view.faces.length / 3]")
    assert 2000 < triangles[0] < 0.6 * triangles[1]
    small = full[::2, ::2][: coarse.shape[0], : coarse.shape[1]]
    coarse = coarse[: small.shape[0], : small.shape[1]]
    seen = [picture.min(axis=2) < 235 for picture in (small, coarse)]
    assert (seen[0] & seen[1]).sum() / (seen[0] | seen[1]).sum() > 0.96
    both = seen[0] & seen[1]
    apart = np.abs(small[both] - coarse[both]).max(axis=1)
    assert np.quantile(apart, 0.9) < 40  # no holes, no dark sides


def test_no_coarse_triangle_is_folded_over(opened):
    """Seen from outside, a triangle wound the other way would be lit as the inside is."""
    faces, positions, normals = (
        np.array(opened.run(f"return Array.from({name})"))
        for name in (
            "coarserFaces(pliant.view.positions, pliant.view.normals, pliant.view.faces, 3000)",
            "pliant.view.positions",
            "pliant.view.normals",
        )
    )
    a, b, c = positions.reshape(-1, 3)[faces.reshape(-1, 3)].transpose(1, 0, 2)
    outwards = normals.reshape(-1, 3)[faces.reshape(-1, 3)].sum(axis=1)
    assert len(a) > 1000
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), outwards) >= 0).all()


def test_dragging_is_coarse_where_frames_are_slow_and_rest_is_full(opened):
    run = opened.run
    run("pliant.page.look('front')")
    before = opened.picture()
    drag = """const { view } = pliant, { canvas } = view, box = canvas.getBoundingClientRect();
    window.widths = [];
    view.ondraw = () => widths.push([canvas.width, view.motion.moving]);
    canvas.setPointerCapture = () => {};
    view.motion.learn = () => {}; // as measured
    view.motion.level = arguments[0];
    const fire = (type, x) => canvas.dispatchEvent(new PointerEvent(type,
      { pointerId: 1, clientX: box.left + x, clientY: box.top + 50, buttons: 1, bubbles: true }));
    fire("pointerdown", 50); fire("pointermove", 60); fire("pointermove", 90); fire("pointermove", 50);
    fire("pointermove", 60); fire("pointermove", 50); fire("pointercancel", 50);"""
    for level, scale in ((2, 0.5), (0, 1.0)):
        run(drag, level)
        deadline = time.monotonic() + 20
        while run("return pliant.view.motion.moving || pliant.view.waiting"):
            assert time.monotonic() < deadline
            time.sleep(0.05)
        drawn = run("return widths")
        moving = {width for width, moves in drawn if moves}
        assert moving == {round(before.shape[1] * scale)}
        if level:
            assert drawn[-1] == [before.shape[1], False]
    run("pliant.page.look('front')")
    assert np.array_equal(opened.picture(), before)
    assert opened.errors() == []


def test_scripts_draw_in_full_whatever_was_learned(opened):
    """Pictures that tests and scripts take do not depend on how busy the machine is."""
    run = opened.run
    run("pliant.view.motion.level = 2; pliant.view.turn(0.1, 0)")
    width = run("pliant.view.draw(); return pliant.view.canvas.width")
    assert width == run("return Math.round(pliant.view.canvas.clientWidth * Math.min(devicePixelRatio, 2))")
