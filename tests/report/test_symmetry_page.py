"""The page of symmetries: what is drawn joins points with their images, a button a symmetry, in a browser too."""

from __future__ import annotations

import numpy as np
import pytest

from pliant import InputError, shapes, symmetry_page
from pliant.matching.symmetry import Symmetry, SymmetryResult
from pliant.report import correspondence_sources, write_page


@pytest.fixture(scope="module")
def figure():
    return shapes.quadruped(1000)


@pytest.fixture(scope="module")
def result(figure):
    """The true mirror, and the part of it that carries the left to the right."""
    n = figure.mesh.n_vertices
    left = np.isin(figure.parts, [i for i, name in enumerate(figure.part_names) if "left" in name])
    right = np.zeros(n, bool)
    right[figure.symmetry[left]] = True
    numbers = (0.9, 0.1, 0.01, 1.0, 0.02, 0.8)
    mirror = Symmetry(np.ones(n, bool), np.ones(n, bool), figure.symmetry, np.eye(3), *numbers)
    limbs = Symmetry(
        left, right, np.where(left, figure.symmetry, -1), np.eye(3), *numbers, "partial", implied_by=0
    )
    return SymmetryResult((mirror, limbs), ("a <reason>",), {"samples": 100, "parts": True})


def test_ends_of_a_reflection_lie_on_one_side(figure, result):
    ends = correspondence_sources(figure.mesh, result.symmetries[0], 30)
    assert len(ends) == 30
    assert len(np.unique(np.r_[ends, figure.symmetry[ends]])) == 60
    moved = figure.mesh.vertices[figure.symmetry[ends]] - figure.mesh.vertices[ends]
    assert (moved @ moved[0] > 0).all()
    assert result.symmetries[1].source[correspondence_sources(figure.mesh, result.symmetries[1])].all()


def test_the_page_holds_a_button_and_a_row_each_and_what_was_refused(figure, result):
    html = symmetry_page(figure.mesh, result, title="A <beast>", up="y")
    assert html.count('class="symmetry"') == 2
    assert "A &lt;beast&gt;" in html
    assert "a &lt;reason&gt;" in html
    assert "https:" not in html
    assert 'src="' not in html


def test_what_does_not_fit_is_refused(result):
    ball = shapes.icosphere(2)
    with pytest.raises(InputError, match="no symmetry"):
        symmetry_page(ball, SymmetryResult((), ("none",), {}), title="none")
    with pytest.raises(InputError, match="this one has 162"):
        symmetry_page(ball, result, title="another")


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_buttons_lines_and_picked_points(browser, figure, result, tmp_path):
    page = write_page(tmp_path / "page.html", symmetry_page(figure.mesh, result, title="beast", up="y"))
    run = browser.open(page, (1200, 1000)).run
    lines = "pliant.view.draw(); return document.querySelectorAll('#links line').length"
    assert run(lines) == 40
    # A line ends where its vertex and the vertex's image are drawn.
    ends = run(
        "const { from, to, line } = pliant.page.links[3];"
        "return [from, to, line.getAttribute('x1'), pliant.view.project(from)[0], line.getAttribute('y2'), "
        "pliant.view.project(to)[1]]"
    )
    assert figure.symmetry[ends[0]] == ends[1]
    np.testing.assert_allclose([float(ends[2]), float(ends[4])], [ends[3], ends[5]], atol=0.06)
    run("const d = document.getElementById('drawn'); d.value = 5; d.dispatchEvent(new Event('input'))")
    assert run(lines) == 5
    inside = int(np.flatnonzero(result.symmetries[1].source)[0])
    run("document.querySelectorAll('[data-symmetry]')[1].click(); pliant.page.select(arguments[0])", inside)
    assert run("return pliant.view.mirrored") == figure.symmetry[inside]
    assert run("return pliant.page.links.every(({ from, to }) => to >= 0)")
    pressed = "return [...document.querySelectorAll('[data-symmetry]')].map((b) => b.ariaPressed)"
    assert run(pressed) == ["false", "true"]
    run("pliant.page.select(arguments[0])", int(np.flatnonzero(~result.symmetries[1].source)[0]))
    assert "not carried" in run("return document.getElementById('told').textContent")
    browser.wide(390, 844)
    assert run("return document.documentElement.scrollWidth") == 390
    assert browser.errors() == []
