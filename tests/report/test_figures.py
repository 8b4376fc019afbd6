"""Figures: right colours at known places, limits that are stated, files without a display."""

from __future__ import annotations

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pliant import shapes
from pliant.errors import InputError
from pliant.report import histogram_figure, surface_figure
from pliant.report.colours import COLOUR_MAPS, MISSING, colour_table, colours_of, robust_limits
from pliant.report.figures import _round_length, hemisphere_views


def texts(figure) -> str:
    figure.draw_without_rendering()
    found = [text.get_text() for text in figure.texts]
    found += [axes.get_xlabel() for axes in figure.axes]
    return "\n".join(found)


def centre_of(axes) -> np.ndarray:
    image = np.asarray(axes.images[0].get_array())
    return image[image.shape[0] // 2, image.shape[1] // 2]


@pytest.fixture(scope="module")
def sphere():
    return shapes.icosphere(3)


@pytest.mark.parametrize("name", COLOUR_MAPS)
def test_colour_tables_hold_256_colours(name):
    table = colour_table(name)
    assert table.shape == (256, 3)
    assert len(np.unique(table, axis=0)) > 200


def test_known_values_get_their_colour_and_missing_ones_grey():
    table = colour_table("viridis")
    seen = colours_of([-5.0, 0.0, 0.5, 1.0, 9.0, np.nan, np.inf], 0.0, 1.0, table) * 255
    assert np.allclose(seen[[0, 1]], table[0])
    assert np.allclose(seen[2], table[128])
    assert np.allclose(seen[[3, 4]], table[255])
    assert np.allclose(seen[[5, 6]] / 255, MISSING, atol=1 / 255)


@given(st.lists(st.floats(-1e6, 1e6) | st.just(np.nan), max_size=40))
def test_limits_always_ascend_and_stay_within_the_values(values):
    low, high = robust_limits(values)
    assert low < high
    known = np.array(values)[np.isfinite(values)] if values else np.array([])
    if known.size and np.ptp(known) > 0:
        assert known.min() <= low < high <= known.max()


def test_limits_ignore_a_wild_value():
    assert robust_limits([*range(101), 1e9])[1] < 102
    assert robust_limits([0.0] * 99 + [5.0]) == (0.0, 5.0)  # both percentiles are 0: the whole range


def test_the_colour_in_the_middle_of_each_view_is_that_of_the_value_there(sphere):
    # Coloured by x: the left view looks at x = -1 (first colour), the right one at x = +1 (last colour).
    figure = surface_figure(sphere, sphere.vertices[:, 0], views=("left", "right"), limits=(-1, 1))
    table = colour_table("viridis").astype(float)
    for axes, colour in zip(figure.axes, (table[0], table[255]), strict=False):
        seen = centre_of(axes)[:3].astype(float)
        assert np.allclose(seen / np.linalg.norm(seen), colour / np.linalg.norm(colour), atol=0.05)


def test_limits_and_missing_values_are_stated(sphere):
    field = sphere.vertices[:, 2].copy()
    field[:7] = np.nan
    figure = surface_figure(sphere, field, title="Height", colour_bar_label="height (cm)", length_unit="mm")
    said = texts(figure)
    assert "percentiles 2 to 98" in said
    assert "no value (7 vertices)" in said
    assert "height (cm)" in said
    assert " mm" in said
    assert " units" in texts(surface_figure(sphere, field))
    assert "percentiles" not in texts(surface_figure(sphere, field, limits=(0, 1)))


def test_a_logarithmic_scale_gives_each_decade_its_share(sphere):
    # Seen from the left every vertex has the value 10, in the middle of 1 to 100; zeros elsewhere are allowed.
    field = np.where(sphere.vertices[:, 0] < 0.5, 10.0, 0.0)
    figure = surface_figure(sphere, field, views=["left"], limits=(1, 100), scale="log")
    seen, colour = centre_of(figure.axes[0])[:3].astype(float), colour_table("viridis")[128].astype(float)
    assert np.allclose(seen / np.linalg.norm(seen), colour / np.linalg.norm(colour), atol=0.05)
    assert figure.axes[1].get_xscale() == "log"
    zeros = surface_figure(sphere, field, views=["right"], limits=(1, 100), scale="log")
    seen, colour = centre_of(zeros.axes[0])[:3].astype(float), colour_table("viridis")[0].astype(float)
    assert np.allclose(seen / np.linalg.norm(seen), colour / np.linalg.norm(colour), atol=0.05)


def test_all_views_share_one_scale():
    box = shapes.ellipsoid((3.0, 2.0, 1.0), 3)
    figure = surface_figure(box, box.vertices[:, 0], views=("front", "right", "top"))
    sizes = [np.asarray(axes.images[0].get_array()).shape[:2] for axes in figure.axes[:3]]
    front, right, top = (np.array(size) - 8 for size in sizes)
    assert front[1] == pytest.approx(top[1], abs=2)  # both show the length in x
    assert front[0] == pytest.approx(right[0], abs=2)  # both show the height
    assert front[1] / front[0] == pytest.approx(3, rel=0.03)


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_figures_are_written_without_a_display(sphere, suffix, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    out = io.BytesIO()
    surface_figure(sphere, sphere.vertices[:, 0], views=["front"], width=3).savefig(out, format=suffix)
    assert len(out.getvalue()) > 2000


def test_drawing_leaves_pyplot_alone(sphere):
    import matplotlib.pyplot as plt

    before = plt.get_fignums()
    surface_figure(sphere, sphere.vertices[:, 0])
    histogram_figure({"x": sphere.vertices[:, 0]})
    assert plt.get_fignums() == before


@pytest.mark.parametrize("count", [1, 2, 5])
def test_any_number_of_views_fits_the_page(sphere, count):
    views = ("left", "right", "front", "back", "top")[:count]
    figure = surface_figure(sphere, sphere.vertices[:, 0], views=views)
    for axes in figure.axes:
        box = axes.get_position()
        assert box.x0 >= 0
        assert box.x1 <= 1
        assert box.y0 >= 0
        assert box.y1 <= 1


def test_a_mesh_without_extent_is_drawn_empty():
    from pliant import Mesh

    figure = surface_figure(Mesh([[0, 0, 0]] * 3, [[0, 1, 2]]), [1, 1, 1], views=["front"])
    figure.draw_without_rendering()


@pytest.mark.parametrize("length", [0.0023, 0.7, 1.0, 4.9, 5.0, 37.0, 99.0, 1000.0])
def test_scale_bar_is_the_largest_round_length(length):
    rounded = _round_length(length)
    digit = rounded / 10 ** np.floor(np.log10(rounded) + 1e-9)
    assert round(digit, 6) in (1, 2, 5)
    assert rounded <= length < 2.5 * rounded + 1e-12


def test_hemisphere_views_mirror():
    left, right = hemisphere_views("left"), hemisphere_views("right")
    assert left["lateral"] == right["medial"] == "left"
    assert list(left) == ["lateral", "medial", "dorsal", "ventral"]
    with pytest.raises(InputError, match="'left' or 'right'"):
        hemisphere_views("both")


def test_histogram_bars_are_shares_and_say_what_lies_outside():
    values = np.r_[np.zeros(90), np.full(10, 100.0)]
    figure = histogram_figure({"a": values, "b": values}, bins=10, percentiles=(0, 80), label="v (mm)")
    axes = figure.axes[0]
    heights = axes.patches[0].get_data().values
    assert heights.sum() <= 1 + 1e-12
    assert len(axes.get_legend().get_texts()) == 2
    hidden = histogram_figure({"a": np.arange(101.0)}, percentiles=(0, 90))
    assert "10 of 101 values lie outside" in hidden.axes[0].get_xlabel()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: surface_figure(m, [1.0]), "one value a vertex"),
        (lambda m: surface_figure(m, m.vertices[:, 0], views=[]), "views is empty"),
        (lambda m: surface_figure(m, m.vertices[:, 0], views=["inside"]), "inside"),
        (lambda m: surface_figure(m, m.vertices[:, 0], limits=(2, 1)), "ascend"),
        (lambda m: surface_figure(m, m.vertices[:, 0], colour_map="jet"), "viridis"),
        (lambda m: surface_figure(m, m.vertices[:, 0], scale="cubic"), "'linear' or 'log'"),
        (lambda m: surface_figure(m, -np.ones(m.n_vertices), scale="log"), "above 0"),
        (lambda m: surface_figure(m, m.vertices[:, 0], scale="log", limits=(0, 1)), "above 0"),
        (lambda m: robust_limits([1], percentiles=(9, 1)), "ascend"),
        (lambda m: histogram_figure({}), "series"),
    ],
)
def test_what_cannot_be_drawn_is_refused(sphere, call, message):
    with pytest.raises(InputError, match=message):
        call(sphere)
