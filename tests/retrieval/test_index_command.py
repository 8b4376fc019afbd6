"""``pliant retrieval add, remove, query, serve`` and ``pliant bench service``: files, JSON, exit codes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from tiny_encoder import Image, encoded

from pliant.cli import main
from pliant.retrieval import (
    LocalitySensitiveHashing,
    RetrievalModel,
    ShapeIndex,
    Vocabulary,
    describe_picture,
)

pytest.importorskip("faiss")
httpx = pytest.importorskip("httpx")


def texture(kind: str, seed: int) -> np.ndarray:
    """Stripes or discs, of which no two pictures hold the same."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[:100, :120]
    if kind == "stripes":
        turn = rng.uniform(0, np.pi)
        return np.where(np.sin((x * np.cos(turn) + y * np.sin(turn)) / 3) > 0, 220, 30).astype(np.uint8)
    discs = np.full((100, 120), 30, np.uint8)
    for cx, cy in rng.uniform(10, 90, (12, 2)):
        discs[(x - cx) ** 2 + (y - cy) ** 2 < 60] = 220
    return discs


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    root = tmp_path_factory.mktemp("root")
    for kind in ("discs", "stripes"):
        (root / "pictures" / kind).mkdir(parents=True)
        for seed in range(5):
            (root / "pictures" / kind / f"{seed}.png").write_bytes(encoded(texture(kind, seed)))
    (root / "pictures" / "discs" / "cut.png").write_bytes(encoded(texture("discs", 7))[:400])
    (root / "query.png").write_bytes(encoded(texture("discs", 50)))
    descriptors = [
        describe_picture(texture(kind, seed), points=80).descriptors
        for kind in ("discs", "stripes")
        for seed in range(5)
    ]
    vocabulary = Vocabulary(n_words=20, rng=0).fit(descriptors)
    codes = LocalitySensitiveHashing(bits=64, rng=0).fit(vocabulary.transform(descriptors))
    RetrievalModel(vocabulary, codes, {"points": 80}).save(root / "model")
    return root


@pytest.fixture(scope="module")
def index(root):
    assert (
        main(
            ["retrieval", "add", str(root / "index"), str(root / "pictures"), "--model", str(root / "model")]
        )
        == 0
    )
    return root / "index"


def test_add_says_what_it_did_and_names_what_it_left_out(root, tmp_path, capsys):
    arguments = ["retrieval", "add", str(tmp_path / "index"), str(root / "pictures"), "--json"]
    assert main([*arguments, "--model", str(root / "model")]) == 0
    out = capsys.readouterr()
    told = json.loads(out.out)
    assert told["added"] == list(range(1, 11))
    assert list(told["failures"]) == [str(root / "pictures" / "discs" / "cut.png")]
    assert "cut.png" in out.err
    assert out.err.count("\n") == 1
    assert main(arguments) == 0
    again = json.loads(capsys.readouterr().out)
    assert (again["added"], again["unchanged"], again["items"]) == ([], 10, 10)


def test_an_index_that_is_not_there_needs_a_model_and_one_that_is_there_takes_none(
    root, index, tmp_path, capsys
):
    assert main(["retrieval", "add", str(tmp_path / "none"), str(root / "pictures")]) == 3
    assert "name a model with --model" in capsys.readouterr().err
    assert main(["retrieval", "add", str(index), str(root / "pictures"), "--model", str(root / "model")]) == 3
    assert "leave --model away" in capsys.readouterr().err
    assert main(["retrieval", "add", str(tmp_path / "new"), str(root), "--model", str(tmp_path)]) == 3
    assert not (tmp_path / "new").exists()


def test_query_gives_the_nearest_as_json_and_nothing_else(root, index, capsys):
    assert main(["retrieval", "query", str(index), str(root / "query.png"), "-k", "5", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["label"] == "discs"
    assert len(told["matches"]) == 5
    keys = [(match["distance"], match["id"]) for match in told["matches"]]
    assert keys == sorted(keys)
    with ShapeIndex.load(index) as opened:
        found = opened.search(opened.model.encode([root / "query.png"]), 5)
    assert [match["id"] for match in told["matches"]] == found.ids[0].tolist()


def test_query_writes_a_figure_and_pages(root, index, tmp_path, capsys):
    arguments = [
        "retrieval",
        "query",
        str(index),
        str(root / "query.png"),
        "-o",
        str(tmp_path / "out"),
        "-k",
        "3",
    ]
    assert main([*arguments, "--label", "stripes"]) == 0
    assert "most likely: stripes (3 of 3)" in capsys.readouterr().out
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "query.json", "query.png", "match-1.html", "match-2.html", "match-3.html"
    }  # fmt: skip
    with Image.open(tmp_path / "out" / "query.png") as drawn:
        assert drawn.size[0] > 800
    assert len(json.loads((tmp_path / "out" / "query.json").read_text(encoding="utf-8"))["matches"]) == 3
    assert (tmp_path / "out" / "match-1.html").read_text(encoding="utf-8").startswith("<!doctype html>")


def test_remove_removes_all_or_none(root, tmp_path, capsys):
    index = ShapeIndex(64)
    index.add(np.zeros((4, 8), np.uint8))
    index.save(tmp_path / "index")
    assert main(["retrieval", "remove", str(tmp_path / "index"), "2", "9"]) == 3
    assert "1 of 2 ids are not in the index: [9]" in capsys.readouterr().err
    assert main(["retrieval", "remove", str(tmp_path / "index"), "2", "3"]) == 0
    assert "removed 2; 2 are left" in capsys.readouterr().out


@pytest.mark.parametrize("command", ["query", "serve", "remove"])
def test_what_is_no_index_ends_with_3_and_one_line(root, tmp_path, capsys, command):
    rest = {"query": [str(root / "query.png")], "serve": [], "remove": ["1"]}[command]
    assert main(["retrieval", command, str(tmp_path / "none"), *rest]) == 3
    out = capsys.readouterr()
    assert not out.out
    assert out.err.count("\n") == 1
    assert "no such index" in out.err


def test_serving_beyond_this_machine_without_a_token_is_refused(index, capsys, monkeypatch):
    monkeypatch.delenv("PLIANT_TOKEN", raising=False)
    assert main(["retrieval", "serve", str(index), "--host", "0.0.0.0"]) == 3
    assert "give a token of 16 or more characters" in capsys.readouterr().err


def test_serve_answers_until_it_is_interrupted(root, index):
    code = "from pliant.cli import main; raise SystemExit(main())"
    command = [sys.executable, "-u", "-c", code, "retrieval", "serve", str(index), "--port", "0"]
    token = "a-token-from-the-environment"
    with subprocess.Popen(
        command,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PLIANT_TOKEN": token},
    ) as process:
        try:
            address = process.stdout.readline().split(" at ")[1].split()[0]
            assert httpx.get(address + "api/index").status_code == 401
            answer = httpx.post(
                address + "api/query",
                files={"image": ("q.png", (root / "query.png").read_bytes())},
                headers={"Authorization": f"Bearer {token}"},
                timeout=120,
            )
            assert answer.json()["label"] == "discs"
        finally:
            process.send_signal(signal.SIGINT)
        _, complaints = process.communicate(timeout=60)
    assert "Traceback" not in complaints
    assert token not in complaints


def test_bench_measures_search_queries_and_clients(root, index, capsys):
    pytest.importorskip("psutil")
    arguments = ["bench", "service", str(index), str(root / "query.png"), "--codes", "20000", "--json"]
    assert main([*arguments, "--clients", "3", "--seconds", "2"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["hamming"]["wrong"] == 0
    assert told["query"]["items"] == 10
    assert told["clients"]["errors"] == 0, told["clients"]["first_error"]
    assert told["clients"]["answers"] >= 3
