"""The interactive page as a document: what it carries, and that nothing escapes into it."""

from __future__ import annotations

import base64
import json
import re
import zlib
from html.parser import HTMLParser

import numpy as np
import pytest

from pliant import Mesh, shapes
from pliant.errors import InputError
from pliant.report import surface_page, write_page
from pliant.report._payload import packed as _packed
from pliant.report.page import _readable

KINDS = {"float32": "<f4", "uint32": "<u4", "uint8": "u1"}


class Outline(HTMLParser):
    """Collects the tags and identifiers, and everything that could reach outside the file."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.data_text, self._in_data = "", False
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        self._in_data = dict(attrs).get("id") == "surface-data"

    def handle_endtag(self, tag):
        self._in_data = False

    def handle_data(self, data):
        self.data_text += data if self._in_data else ""


def unpacked(packed: dict) -> np.ndarray:
    raw = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), dtype=np.uint8)
    dtype = np.dtype(KINDS[packed["kind"]])
    planes = raw.reshape(dtype.itemsize, packed["length"])
    return np.ascontiguousarray(planes.T).view(dtype).ravel()


def data_of(html: str) -> dict:
    return json.loads(Outline(html).data_text)


@pytest.fixture(scope="module")
def sphere() -> Mesh:
    return shapes.icosphere(2)


@pytest.fixture(scope="module")
def page(sphere) -> str:
    field = sphere.vertices[:, 2].copy()
    field[3] = np.nan
    counts = np.arange(sphere.n_vertices * 4).reshape(-1, 4)
    return surface_page(
        sphere,
        {"height (mm)": field, "x": sphere.vertices[:, 0]},
        title="A sphere",
        histograms={"GCH": counts},
        edges=[0, 1, 2, 3, 4],
        settings={"weights": "area"},
    )


def test_the_page_carries_the_mesh_and_its_values(sphere, page):
    data = data_of(page)
    assert np.array_equal(unpacked(data["positions"]), sphere.vertices.astype("f4").ravel())
    codes = unpacked(data["faces"]).astype(np.int64)
    differences = np.where(codes & 1, -((codes + 1) >> 1), codes >> 1)
    assert np.array_equal(np.cumsum(differences), sphere.faces.ravel())
    height = unpacked(data["layers"][0]["values"])
    assert np.isnan(height[3])
    assert np.array_equal(np.delete(height, 3), np.delete(sphere.vertices[:, 2], 3).astype("f4"))
    assert data["layers"][0]["missing"] == 1
    assert unpacked(data["histogramArrays"][0]).reshape(-1, 4)[5].tolist() == [20, 21, 22, 23]


@pytest.mark.parametrize("dtype", ["float32", "uint32", "uint8"])
def test_packing_keeps_every_bit(dtype):
    rng = np.random.default_rng(0)
    array = rng.integers(0, 255, 999).astype(dtype) * (np.float32(0.37) if dtype == "float32" else 1)
    array = array.astype(dtype)
    assert np.array_equal(unpacked(_packed(array)), array)


def test_the_page_stands_alone(page):
    outline = Outline(page)
    for tag, attributes in outline.tags:
        for name in ("src", "href"):
            assert (attributes.get(name) or "data:").startswith("data:"), (tag, attributes)
        assert tag not in {"iframe", "object", "embed", "base"}
    assert "http://" not in page.replace("http://www.w3.org/2000/svg", "")
    assert "https://" not in page
    policy = next(a["content"] for _, a in outline.tags if a.get("http-equiv") == "Content-Security-Policy")
    assert "default-src 'none'" in policy


def test_the_page_can_be_read_without_eyes_or_mouse(page):
    outline = Outline(page)
    ids = [a["id"] for _, a in outline.tags if "id" in a]
    assert len(ids) == len(set(ids))
    assert next(a for tag, a in outline.tags if tag == "html")["lang"] == "en"
    labelled = {a["for"] for tag, a in outline.tags if tag == "label"}
    for tag, attributes in outline.tags:
        if tag in {"select", "input"}:
            assert attributes["id"] in labelled
        if tag == "canvas":
            assert attributes["tabindex"] == "0"
            assert attributes["aria-label"]
    assert re.search(r"<title>A sphere</title>", page)


def test_text_cannot_become_markup(sphere):
    evil = "</script><script>alert(1)</script>\"'&<!--"
    html = surface_page(
        sphere,
        {evil: sphere.vertices[:, 0]},
        title=evil,
        notes=evil,
        settings={evil: evil},
        histograms={evil: np.ones((sphere.n_vertices, 2))},
        length_unit=evil,
    )
    assert html.count("<script") == 3  # the data and the two programs
    assert "alert(1)</script>" not in html
    assert data_of(html)["layers"][0]["name"] == evil
    assert sum(tag == "script" for tag, _ in Outline(html).tags) == 3


def test_a_layer_without_any_value_and_a_constant_one_are_shown(sphere):
    nothing = np.full(sphere.n_vertices, np.nan)
    data = data_of(surface_page(sphere, {"none": nothing, "one": np.ones(sphere.n_vertices)}, title="t"))
    assert [layer["low"] < layer["high"] for layer in data["layers"]] == [True, True]
    assert data["layers"][0]["missing"] == sphere.n_vertices


def test_the_document_is_the_same_twice(sphere):
    pages = {surface_page(sphere, {"x": sphere.vertices[:, 0]}, title="t") for _ in range(2)}
    assert len(pages) == 1


def test_the_page_opens_with_the_scale_asked_for(sphere):
    for scale, text in (("linear", "linear"), ("log", "logarithmic")):
        html = surface_page(sphere, {"v": np.arange(1.0, sphere.n_vertices + 1)}, title="t", scale=scale)
        options = re.search(r'<select id="scale">(.*?)</select>', html)[1]
        assert re.findall(r'value="(\w+)" selected>(\w+)<', options) == [(scale, text)]
        assert options.count("<option") == 2
    with pytest.raises(InputError, match="scale"):
        surface_page(sphere, {"v": np.ones(sphere.n_vertices)}, title="t", scale="square")


def test_pages_are_written_whole(tmp_path, page):
    target = write_page(tmp_path / "page.html", page)
    assert target.read_text(encoding="utf-8") == page
    with pytest.raises(InputError, match="absent"):
        write_page(tmp_path / "absent" / "page.html", page)
    assert [path.name for path in tmp_path.iterdir()] == ["page.html"]


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (-1.5, "−1.5"), (1.25e-7, "1.25 × 10⁻⁷"), (3e12, "3 × 10¹²"), (-2e-10, "−2 × 10⁻¹⁰")],
)
def test_numbers_are_written_to_be_read(value, text):
    assert _readable(value) == text


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"layers": {}}, "layers is empty"),
        ({"layers": {"x": [1.0, 2.0]}}, "one value a vertex"),
        ({"histograms": {"h": np.ones((3, 4))}}, "shape"),
        ({"histograms": {"h": np.ones(162)}}, "shape"),
        ({"histograms": {"h": np.full((162, 2), np.nan)}}, "finite"),
        ({"histograms": {"h": np.ones((162, 4))}, "edges": [0, 1]}, "5 finite numbers"),
        ({"colour_map": "jet"}, "viridis"),
    ],
)
def test_what_does_not_fit_is_refused(sphere, options, message):
    arguments = {"layers": {"x": sphere.vertices[:, 0]}, "title": "t", **options}
    with pytest.raises(InputError, match=message):
        surface_page(sphere, arguments.pop("layers"), **arguments)


def test_a_mesh_without_faces_is_refused():
    with pytest.raises(InputError, match="no faces"):
        surface_page(Mesh([[0, 0, 0], [1, 0, 0]], []), {"x": [0, 1]}, title="t")
