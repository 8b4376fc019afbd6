"""Figures and the page of a cohort: the right colours at the right places, all text escaped."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb

from pliant import shapes
from pliant.cortex import CohortResult, Subject, Variability, variability
from pliant.errors import InputError
from pliant.report.cohort import extremes_figure, ranking_figure, sites_figure
from pliant.report.cohort_page import CohortTable, cohort_page

SITES = 20


@pytest.fixture(scope="module")
def found() -> CohortResult:
    rng = np.random.default_rng(0)
    spread = np.linspace(0.02, 1, SITES)[:, None]
    values = np.abs(0.2 + rng.normal(size=(7, SITES, 5)) * spread)
    values[2] = np.nan
    people = tuple(Subject(f"s{i}", Path(f"s{i}.ply")) for i in range(7))
    errors = ("", "", "<b>gone</b>", "", "", "", "")
    names = tuple(f"site{i}" for i in range(SITES))
    shape = (7, SITES)
    return CohortResult(people, errors, names, values, np.arange(6.0), np.zeros(shape), np.zeros(shape))


@pytest.fixture(scope="module")
def ranking(found: CohortResult) -> Variability:
    return variability(found.histograms, edges=found.edges, rng=0, resamples=30)


def coloured(image: np.ndarray, colour: str) -> np.ndarray:
    """Pixels whose hue is that of a colour, however it is lit."""
    visible = image[..., 3] > 200
    shade = image[..., :3].astype(float)
    shade /= np.maximum(np.linalg.norm(shade, axis=2, keepdims=True), 1)
    wanted = np.array(to_rgb(colour)) / np.linalg.norm(to_rgb(colour))
    return visible & (shade @ wanted > 0.995)


def test_sites_are_green_and_pink_where_they_lie(ranking: Variability) -> None:
    ball = shapes.icosphere(3)
    # Seen from the left (along x): the regular site high up, the variable one low down, others behind.
    vertices = np.full(SITES, int(np.argmax(ball.vertices[:, 0])))
    high, low = (np.array([-0.8, 0, z]) for z in (0.6, -0.6))
    vertices[ranking.regular[0]] = np.argmax(ball.vertices @ high)
    vertices[ranking.variable[0]] = np.argmax(ball.vertices @ low)
    image = sites_figure(ball, vertices, ranking, views=("left",)).axes[0].images[0].get_array()
    green, pink = coloured(image, "#2e8b57"), coloured(image, "#d6336c")
    assert green.sum() > 50
    assert pink.sum() > 50
    middle = image.shape[0] / 2
    assert np.argwhere(green)[:, 0].max() < middle < np.argwhere(pink)[:, 0].min()
    # Round: as high as wide but for the slant.
    for dot in (green, pink):
        rows, columns = np.ptp(np.argwhere(dot), axis=0)
        assert 0.6 < rows / columns < 1.1
    with pytest.raises(InputError, match="none of the sites"):
        sites_figure(ball, np.full(SITES, -1), ranking)


def test_the_ranking_is_drawn_in_ascending_order(found: CohortResult, ranking: Variability) -> None:
    axes = ranking_figure(found, ranking, label="deviation").axes[0]
    drawn = axes.lines[0].get_ydata()
    np.testing.assert_allclose(drawn, np.sort(ranking.mad))
    named = " ".join(text.get_text() for text in axes.texts)
    assert found.sites[ranking.regular[0]] in named
    assert found.sites[ranking.variable[0]] in named


def test_extreme_histograms_have_a_line_a_subject(found: CohortResult, ranking: Variability) -> None:
    figure = extremes_figure(found, ranking, label="log field")
    assert len(figure.axes) == 2
    regular, variable = figure.axes
    assert len(regular.patches) == 8  # seven subjects and their mean
    mean = regular.patches[-1].get_data().values
    np.testing.assert_allclose(mean, np.nanmean(found.histograms[:, ranking.regular[0]], axis=0))
    assert (regular.get_xlabel(), variable.get_xlabel()) == ("", "log field")
    with pytest.raises(InputError, match="at least 1"):
        extremes_figure(found, ranking, count=0)


def test_the_page_escapes_all_text_and_loads_nothing(found: CohortResult, ranking: Variability) -> None:
    odd = replace(found, sites=tuple(f"<i>{name}" for name in found.sites))
    table = CohortTable("More & more", ("a", "b"), [("x<y", "1")], note="'quoted'")
    page = cohort_page(
        odd, ranking, title="A <title>", figures={"A caption": ranking_figure(odd, ranking)},
        surface='<p class="inner">$surface</p>', facts={"sites": "20"}, tables=[table], settings={"edges": [0.5, 1.0]},
    )  # fmt: skip
    for text in ("<i>", "<b>gone", 'class="inner"', "<title>A <"):
        assert text not in page, text
    for text in (
        "&lt;b&gt;gone",
        "x&lt;y",
        "More &amp; more",
        "0.5, 1",
        "data:image/png;base64,",
        "$surface",
    ):
        assert text in page, text
    assert "default-src 'none'" in page
