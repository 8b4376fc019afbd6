"""Bull's-eyes and segment pictures: every segment where the standard puts it, in its territory's hue."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.patches import Wedge

from pliant import InputError, shapes
from pliant.heart import TERRITORIES, VentricleFrame, describe_heart, heart_phantom
from pliant.report import bulls_eye_figure, segment_figure, write_page
from pliant.report.heart import _section, segment_colours
from pliant.report.heart_page import heart_page


def test_bulls_eye_puts_each_segment_where_the_standard_does() -> None:
    axes = bulls_eye_figure(np.arange(1.0, 18.0)).axes[0]
    wedges = [patch for patch in axes.patches if isinstance(patch, Wedge)]
    assert len(wedges) == 17
    middles = {text.get_text(): text.get_position() for text in axes.texts}
    assert middles["1"][1] > 0.8
    assert middles["4"][1] < -0.8
    # The septum is to the left, the lateral wall to the right.
    assert max(middles["8"][0], middles["9"][0], middles["14"][0]) < 0
    assert min(middles["11"][0], middles["12"][0], middles["16"][0]) > 0


@pytest.mark.parametrize(("largest", "shown"), [(0.245, "0.140"), (95.25, "0.1"), (2451.0, "0")])
def test_values_have_as_many_decimals_as_the_largest_needs(largest: float, shown: str) -> None:
    values = np.full(17, 0.14)
    values[10] = largest
    texts = [text.get_text() for text in bulls_eye_figure(values).axes[0].texts]
    assert texts.count(shown) == 16


def test_a_missing_value_is_grey_and_a_dash() -> None:
    values = np.arange(1.0, 18.0)
    values[4] = np.nan
    axes = bulls_eye_figure(values).axes[0]
    assert "–" in [text.get_text() for text in axes.texts]
    assert axes.patches[4].get_facecolor()[:3] == pytest.approx((0.72,) * 3, abs=0.01)


def test_segments_share_the_hue_of_their_territory_and_differ() -> None:
    colours = segment_colours()
    assert len({tuple(c) for c in colours.round(4)}) >= 14
    strongest = {
        name: {int(np.argmax(colours[s])) for s in segments} for name, segments in TERRITORIES.items()
    }
    assert strongest == {"LAD": {0}, "LCX": {1}, "RCA": {2}}


def test_a_section_of_a_ball_is_its_circle() -> None:
    ball = shapes.icosphere(3, radius=10.0)
    lines = np.array(_section(ball, np.array([0, 0, 6.0]), np.array([1.0, 0, 0]), np.array([0, 1.0, 0])))
    assert np.linalg.norm(lines.reshape(-1, 2), axis=1) == pytest.approx(8.0, abs=0.15)


def test_wrong_sizes_are_refused() -> None:
    frame = VentricleFrame(np.zeros(3), np.array([0.0, 0, 1]), np.eye(3), "landmarks", 1.0)
    with pytest.raises(InputError, match="17 segments"):
        bulls_eye_figure(np.ones(16))
    with pytest.raises(InputError, match="labels"):
        segment_figure(shapes.icosphere(1), np.ones(3, int), frame)


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_the_page_of_a_ventricle_fits_a_phone(browser, tmp_path) -> None:
    phantom = heart_phantom(spacing=4.0, mesh_step=2.5, rng=1)
    found = describe_heart(phantom.mesh, landmarks=phantom.landmarks, points=40)
    html = heart_page(found, title="A_name_of_a_file_that_is_far_too_long_for_one_line.vtk")
    opened = browser.open(write_page(tmp_path / "page.html", html))
    opened.wide(390, 844)
    assert opened.run("return document.documentElement.scrollWidth") == 390
    # The table of segments scrolls in a region that keys reach.
    region = "return document.querySelector('[aria-label=\"Numbers of segments\"]')"
    assert opened.run(region + ".tabIndex") == 0
    assert opened.run(region + ".scrollWidth") > opened.run(region + ".clientWidth")
    opened.wide(1280, 800)
