"""``pliant image``: files, JSON and nothing else on standard output, exit codes."""

from __future__ import annotations

import json

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from pliant.cli import main

pytest.importorskip("cv2")
Image = pytest.importorskip("PIL.Image")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("pictures")
    records = []
    for k in range(2):
        scene = gaussian_filter(np.random.default_rng(k).random((200, 260)), 4)
        scene = np.rint(20 + 210 * (scene - scene.min()) / np.ptp(scene)).astype(np.uint8)
        Image.fromarray(scene).save(root / f"{k}a.png")
        Image.fromarray(255 - scene).save(root / f"{k}b.png")
        box = [0, 0, 260, 200]
        records.append(
            {"name": f"scene{'ab'[k]}", "kind": "negative", "image1": f"{k}a.png", "image2": f"{k}b.png"}
            | {"box1": box, "box2": box, "homography": [1, 0, 0, 0, 1, 0, 0, 0, 1]}
        )
    (root / "pairs.json").write_text(json.dumps(records))
    return root


def test_match_writes_a_figure_a_page_and_json(folder, tmp_path, capsys):
    arguments = [
        "image",
        "match",
        str(folder / "0a.png"),
        str(folder / "0b.png"),
        "-o",
        str(tmp_path / "out"),
    ]
    assert main([*arguments, "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    written = json.loads((tmp_path / "out" / "match.json").read_text(encoding="utf-8"))
    assert printed == written
    assert written["score"] > 25
    assert np.allclose(np.array(written["transform"])[:2, 2], 0, atol=2)
    assert (tmp_path / "out" / "match.png").read_bytes()[:4] == b"\x89PNG"
    assert (tmp_path / "out" / "match.html").read_text(encoding="utf-8").startswith("<!doctype html>")


def test_evaluate_prints_the_scores_as_json_and_nothing_else(folder, capsys):
    assert main(["image", "evaluate", str(folder / "pairs.json"), "--json"]) == 0
    scores = json.loads(capsys.readouterr().out)
    methods = ["proposed", "sift", "orb", "akaze", "fast", "gb", "whole", "centre"]
    assert list(scores["mrs"]) == list(scores["fpr"]) == methods
    assert scores["mrs"]["whole"] == 1.0
    assert scores["fpr"]["whole"] == 0.0
    assert scores["mrs"]["centre"] == pytest.approx(0.85**2)
    assert scores["transform_within_5_percent"] == 1.0
    assert set(scores["moved"]["mrs"]) == set(methods)


def test_bad_pictures_end_with_3_and_one_line(folder, tmp_path, capsys):
    bad = tmp_path / "bad.png"
    bad.write_text("no picture")
    assert main(["image", "match", str(bad), str(folder / "0a.png"), "-o", str(tmp_path / "none")]) == 3
    out = capsys.readouterr()
    assert not out.out
    assert out.err.count("\n") == 1
    assert "not a picture" in out.err
