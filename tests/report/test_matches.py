"""Figures and pages of matched pictures: self-contained, escaped, whatever was found."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from pliant.images import as_picture, match_pair
from pliant.report.matches import match_figure, match_page

pytest.importorskip("cv2")


@pytest.fixture(scope="module")
def pair():
    scene = gaussian_filter(np.random.default_rng(0).random((200, 260)), 4)
    scene = (scene - scene.min()) / np.ptp(scene)
    pictures = as_picture(scene), as_picture(1 - scene[10:190, 20:240])
    return (*pictures, match_pair(*pictures))


def test_the_page_holds_everything_and_escapes_text(pair):
    html = match_page(
        *pair, title="<b>one</b> & two", truth=(np.array([1, 2, 30, 40]), np.array([1, 2, 30, 40]))
    )
    assert "<b>one" not in html
    assert "&lt;b&gt;one&lt;/b&gt; &amp; two" in html
    assert not re.search(r"(src|href)\s*=\s*[\"']https?:", html)
    assert not re.search(r"@import|url\(http", html)
    data = json.loads(re.search(r'id="data">(.*?)</script>', html, re.S).group(1))
    assert len(data["points"]) == len(pair[2].points1)
    assert np.allclose(data["boxes"][0], pair[2].box1)
    assert all(image.startswith("data:image/jpeg;base64,") for image in data["images"])


def test_the_figure_shows_boxes_and_matches(pair, tmp_path):
    figure = match_figure(*pair, most=7, truth=(pair[2].box1, pair[2].box2), title="Two")
    assert len(figure.artists) == 7
    assert all(len(axis.patches) == 4 for axis in figure.axes)
    figure.savefig(tmp_path / "match.png")
    assert (tmp_path / "match.png").stat().st_size > 10_000


def test_nothing_found_is_said(pair, tmp_path):
    flat = as_picture(np.full((50, 60), 0.5))
    match = match_pair(flat, pair[0])
    figure = match_figure(flat, pair[0], match)
    assert any("score 0" in text.get_text() for text in figure.texts)
    assert not figure.axes[0].patches
    assert "image 1 has edges for only" in match_page(flat, pair[0], match, title="none")
