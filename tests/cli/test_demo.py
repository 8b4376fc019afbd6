"""The demonstration: real cortex, no network, figures and a page."""

from __future__ import annotations

import re
import socket

import numpy as np
import pytest

import pliant
from pliant import cli
from pliant.datasets import fsaverage5
from pliant.errors import InputError, MissingExtraError


@pytest.fixture
def no_network(monkeypatch):
    def refuse(*_, **__):
        pytest.fail("something reached for the network")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)


@pytest.mark.parametrize("surface", ["pial", "white", "infl", "sphere"])
@pytest.mark.parametrize("hemisphere", ["left", "right"])
def test_fsaverage5_is_a_closed_sphere_in_millimetres(surface, hemisphere, no_network):
    mesh = fsaverage5(surface, hemisphere=hemisphere)
    report = pliant.check_up(mesh)
    assert (mesh.n_vertices, mesh.n_faces) == (10242, 20480)
    assert (report.components, report.boundary_loops, report.genus) == (1, 0, 0)
    if surface in ("pial", "white"):
        side = -1 if hemisphere == "left" else 1
        assert side * mesh.vertices[:, 0].mean() > 20
        assert 50_000 < mesh.area < 100_000


def test_pial_lies_outside_white():
    pial, white = fsaverage5("pial"), fsaverage5("white")
    assert np.array_equal(pial.faces, white.faces)
    assert pial.area > white.area
    outwards = np.einsum("nd,nd->n", pial.vertices - white.vertices, white.vertex_normals)
    assert np.mean(outwards > 0) > 0.95  # a few normals turn at the bottom of sharp folds


def test_unknown_surfaces_are_refused():
    with pytest.raises(InputError, match="pial, white"):
        fsaverage5("grey")
    with pytest.raises(InputError, match="left, right"):
        fsaverage5("pial", hemisphere="both")


def test_a_missing_nilearn_is_named(monkeypatch):
    monkeypatch.setattr("pliant.datasets.installed.find_spec", lambda name: None)
    with pytest.raises(MissingExtraError, match="nilearn"):
        fsaverage5()


def test_the_demo_shows_the_field_of_a_hemisphere(tmp_path, monkeypatch, capsys, no_network):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["demo"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    said = captured.out
    field = pliant.gfe(fsaverage5("pial"))
    assert re.search(rf"^ {int(np.argmax(field))} +{field.max():.4g} ", said, re.MULTILINE)
    assert "10242, 30720, 20480" in said
    correlation = np.corrcoef(field, pliant.gfe(fsaverage5("white")))[0, 1]
    assert f"{correlation:.3f}" in said
    written = sorted(path.name for path in (tmp_path / "pliant-demo").iterdir())
    assert written == ["gfe-distribution.png", "gfe.html", "gfe.png"]
    for name in written:
        assert f"pliant-demo/{name}" in said


def test_the_demo_goes_where_it_is_told(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert cli.main(["demo", "-o", str(tmp_path / "file")]) == 2
    assert cli.main(["demo", "-o", str(tmp_path / "file" / "below")]) == 2
    assert "Traceback" not in capsys.readouterr().err
