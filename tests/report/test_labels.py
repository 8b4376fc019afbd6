"""Labels: when whole numbers are names, and whether their colours can be told apart."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

from pliant import ShownSurface, comparison_page, shapes
from pliant.report._payload import surface_payload
from pliant.report.colours import MISSING
from pliant.report.labels import AHA_NAMES, LABEL_COLOURS, is_aha, label_facts, label_values

# Linear RGB to CIE XYZ (D65), and what dichromats see of linear RGB (Viénot 1999), another model than the palette's.
XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
SIGHTS = {
    "usual": np.eye(3),
    "protan": np.array([[0.11238, 0.88762, 0], [0.11238, 0.88762, 0], [0.00401, -0.00401, 1]]),
    "deutan": np.array([[0.29275, 0.70725, 0], [0.29275, 0.70725, 0], [-0.02234, 0.02234, 1]]),
}


def lab(colours: np.ndarray, sight: np.ndarray) -> np.ndarray:
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    ratio = np.clip(linear @ sight.T, 0, 1) @ XYZ.T / (XYZ @ np.ones(3))
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.column_stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])])


@pytest.mark.parametrize("sight", SIGHTS)
@pytest.mark.parametrize(("count", "least"), [(8, 13.0), (18, 11.0), (40, 5.5)])
def test_colours_of_labels_are_apart_for_every_eye(sight, count, least):
    """In CIE Lab, where a difference of 2.3 is just seen, each from each other and from the grey of no value."""
    colours = [[int(c[i : i + 2], 16) / 255 for i in (1, 3, 5)] for c in LABEL_COLOURS[:count]]
    seen = lab(np.array([*colours, MISSING]), SIGHTS[sight])
    gaps = np.linalg.norm(seen[:, None] - seen[None], axis=2) + 1e3 * np.eye(count + 1)
    assert gaps.min() > least


@pytest.mark.parametrize(
    ("values", "labels"),
    [
        (np.repeat([2, 0, -1], 5), (-1, 0, 2)),
        (np.array([True, False] * 4), (0, 1)),
        (np.zeros(9, np.int32), (0,)),
        (np.repeat([1.0, 3.0, np.nan], 20), (1, 3)),
        (np.repeat([1.0, 1.5], 20), None),
        (np.arange(30), None),  # each once: a number, not a label
        (np.repeat(np.arange(41), 10), None),  # too many to tell apart
        (np.repeat([1.0, 2.0], 4), None),  # floats that happen to be whole
        (np.ones(50), None),
        (np.full(50, np.nan), None),
        (np.array([], int), None),
        (np.array(["a", "a"]), None),
    ],
)
def test_whole_numbers_of_few_kinds_are_labels(values, labels):
    assert label_values(values) == labels


def test_the_17_segments_are_known_by_their_names():
    assert is_aha(range(1, 18))
    assert is_aha(range(18))
    assert not is_aha(range(17))
    assert not is_aha(None)
    assert AHA_NAMES[1] == "1 basal anterior"
    assert AHA_NAMES[17] == "17 apex"


def test_a_segment_has_one_colour_whether_or_not_some_vertices_are_in_none():
    all_of_them, with_none = (label_facts(np.arange(18.0), tuple(range(i, 18)), None) for i in (1, 0))
    assert with_none["colours"][1:] == all_of_them["colours"] == list(LABEL_COLOURS[:17])
    assert len(set(with_none["colours"])) == 18


def test_what_is_in_no_segment_is_grey():
    facts = label_facts(np.arange(18.0), tuple(range(18)), None)
    assert facts["names"][0] == "0 no segment"
    assert facts["colours"][0] == "#b8b8b8"
    assert label_facts(np.arange(3.0), (0, 1, 2), None)["colours"] == list(LABEL_COLOURS[:3])


def shown_labels(*arrays):
    """Values and names of the labels that a page carries of surfaces with one layer of one name."""
    surfaces = [ShownSurface(str(i), shapes.icosphere(2), {"id": values}) for i, values in enumerate(arrays)]
    text = comparison_page(surfaces, title="ids")
    data = json.loads(re.search(r'id="surfaces">(.*?)</script>', text, re.S).group(1))
    return [surface["layers"][0]["labels"] for surface in data]


def test_names_of_segments_stay_with_the_surface_that_has_segments():
    number = np.arange(162)
    heart, wall, same = shown_labels(number % 18, number % 3, 1 + number % 17)
    assert heart["names"][1] == same["names"][1] == "1 basal anterior"
    assert heart["colours"][1] == same["colours"][1]
    assert wall["values"] == [0, 1, 2]
    assert wall["names"] == ["0", "1", "2"]
    assert wall["colours"] == list(LABEL_COLOURS[:3])
    # Neither are two sets of labels segments because both together are 0 to 17.
    low, high = shown_labels(number % 9, 9 + number % 9)
    assert low["values"] == high["values"] == list(range(18))
    assert low["names"] == high["names"] == [str(i) for i in range(18)]


def test_labels_of_one_surface_are_labels_whatever_another_has():
    number = np.arange(162)
    labelled, valued = shown_labels(number % 3, number / 7)
    assert labelled["values"] == [0, 1, 2]
    assert valued is None


def test_the_page_carries_each_labels_name_count_and_colour():
    ball = shapes.icosphere(2)
    values = np.repeat([5, 7], [100, 62])
    fields = {"part": values.astype(float), "height": ball.vertices[:, 2]}
    data = surface_payload(
        ball, fields, {}, np.array([0.0]), "z", "", labels={"part": (5, 7)}, names={"part": {7: "seven"}}
    )
    part, height = data["layers"]
    assert part["labels"]["values"] == [5, 7]
    assert part["labels"]["names"] == ["5", "seven"]
    assert part["labels"]["counts"] == [100, 62]
    assert part["labels"]["colours"] == list(LABEL_COLOURS[:2])
    assert height["labels"] is None
