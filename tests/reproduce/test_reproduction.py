from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import pliant
from pliant import InputError
from pliant.cli import main
from pliant.reproduce import Experiment, Findings, Row, experiments, reproduce
from pliant.reproduce import run as running
from pliant.reproduce._closure import closure
from pliant.reproduce._pairs import LOOKS, image_pairs
from pliant.reproduce.bench import Bench
from pliant.reproduce.findings import row_of

FAST = "figure-3.4"


@pytest.fixture
def counted(monkeypatch):
    """Three experiments: one that counts its runs, one that fails, one that lacks its data."""
    runs = []

    def fine(bench):
        runs.append(bench.seed)
        return Findings("holds", "It <holds> & more.", "nothing", (Row("a", 1.0, 2.0, 1.5, 2.5, "noted"),))

    def broken(bench):
        raise InputError("no such thing")

    made = (
        Experiment("table-2.1", "Fine", "claim", "criterion", fine, covers=("figure-2.3",)),
        Experiment("figure-2.9", "Broken", "claim", "criterion", broken),
        Experiment("table-6.2", "Without data", "claim", "criterion", fine, needs=("images/symd",)),
    )
    monkeypatch.setattr(running, "experiments", lambda: made)
    return runs


# Every table and figure of the dissertation that carries a result; the others are drawings of methods.
TABLES = "2.1 2.2 3.1 4.1 5.2 5.3 5.4 5.5 5.6 5.7 5.8 5.9 6.1 6.2"
FIGURES = (
    "2.7 2.8 2.9 2.10 2.11 2.12 3.1 3.2 3.3 3.4 3.5 3.6 3.7 3.8 3.9 3.10 4.1 4.3 4.5 4.6 4.7 4.8 4.9 4.10 4.11 "
    "5.3 5.4 5.5 5.6 5.7 5.8 6.1 6.2 6.5 6.6"
)


def test_every_result_is_covered_once_and_in_order():
    names = [name for e in experiments() for name in (e.name, *e.covers)]
    wanted = [f"table-{n}" for n in TABLES.split()] + [f"figure-{n}" for n in FIGURES.split()]
    assert sorted(names) == sorted(wanted)
    chapters = [e.chapter for e in experiments()]
    assert chapters == sorted(chapters)


def test_criteria_are_stated_for_every_experiment():
    for e in experiments():
        assert e.title
        assert e.claim.endswith(".")
        assert e.criterion.endswith(".")


def test_what_fails_is_said_and_the_rest_goes_on(counted, tmp_path):
    done = reproduce(folder=tmp_path)
    assert [o.findings.verdict for o in done] == ["holds", "not tested", "not tested"]
    assert "no such thing" in done[1].findings.summary
    assert "images/symd" in done[2].findings.summary
    table = (tmp_path / "verdicts.md").read_text(encoding="utf-8").splitlines()
    assert table[2] == "| Table 2.1, Figure 2.3 | claim | **holds** | It <holds> & more. |"
    assert len(table) == 2 + 3
    verdicts = json.loads((tmp_path / "verdicts.json").read_text(encoding="utf-8"))
    assert verdicts[0]["printed"] == 1.0
    assert verdicts[0]["interval"] == [1.5, 2.5]
    assert {"name", "printed", "ours", "interval", "data", "verdict"} <= set(verdicts[0])


def test_results_are_reused_until_seed_or_settings_change(counted, tmp_path):
    for _ in range(2):
        done = reproduce(["table-2.1"], folder=tmp_path)
    assert counted == [0]
    assert done[0].reused
    reproduce(["table-2.1"], folder=tmp_path, rng=1)
    reproduce(["table-2.1"], folder=tmp_path, quick=True)
    assert counted == [0, 1, 0]


def test_what_an_experiment_covers_can_be_asked_for(counted, tmp_path):
    done = reproduce(["figure-2.3"], folder=tmp_path)
    assert [o.experiment.name for o in done] == ["table-2.1"]
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert 'id="figure-2.3"' in page
    assert "Table 2.1, Figure 2.3" in page


def test_the_report_keeps_what_still_stands(counted, tmp_path):
    def listed():
        return [v["name"] for v in json.loads((tmp_path / "verdicts.json").read_text(encoding="utf-8"))]

    reproduce(["table-2.1"], folder=tmp_path)
    done = reproduce(["table-6.2"], folder=tmp_path)
    assert [o.experiment.name for o in done] == ["table-6.2"]
    assert listed() == ["table-2.1", "table-6.2"]
    reproduce(["table-6.2"], folder=tmp_path, rng=1)
    assert listed() == ["table-6.2"]  # the other was made with another seed


def test_a_result_depends_on_the_modules_it_imports_and_no_others():
    def names(module):
        package = Path(pliant.__file__).parent
        return {str(path.relative_to(package).with_suffix("")) for path in closure(f"pliant.{module}")}

    own = names("reproduce.table_2_1")
    assert {
        "reproduce/table_2_1",
        "reproduce/_cylinders",
        "cortex/tuning",
        "geodesic/field",
        "mesh/spin",
    } <= own
    # Pages name segments of the heart; that is all that a cylinder has to do with one.
    elsewhere = {name for name in own if name.split("/")[0] in ("heart", "images", "retrieval", "cli")}
    assert elsewhere == {"heart/segment_names"}
    assert "mesh/shapes/figures" in names("reproduce.figure_3_9")
    assert "heart/features" in names("reproduce.table_5_7")


def test_a_broken_result_file_is_computed_again(counted, tmp_path):
    reproduce(["table-2.1"], folder=tmp_path)
    (tmp_path / "results" / "table-2.1.json").write_text("{")
    reproduce(["table-2.1"], folder=tmp_path)
    assert counted == [0, 0]


def test_a_failure_is_tried_again(counted, tmp_path):
    reproduce(["figure-2.9"], folder=tmp_path)
    assert not reproduce(["figure-2.9"], folder=tmp_path)[0].reused


def test_text_is_escaped_in_the_report(counted, tmp_path):
    reproduce(folder=tmp_path)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "It &lt;holds&gt; &amp; more." in page
    assert "src=" not in page.replace('src="data:', "")
    assert "http:" not in page
    assert "https:" not in page


def test_a_table_shows_the_columns_that_say_something(tmp_path, monkeypatch):
    made = []

    def run(bench):
        return Findings("holds", "It holds.", "nothing", tuple(made))

    monkeypatch.setattr(running, "experiments", lambda: (Experiment("table-2.1", "T", "c.", "c.", run),))

    def heads(rows):
        made[:] = rows
        reproduce(folder=tmp_path / str(len(rows)))
        page = (tmp_path / str(len(rows)) / "report.html").read_text(encoding="utf-8")
        return page.split('class="numbers"')[1].split("</thead>")[0], page

    plain, _ = heads([Row("a", None, 2.0)])
    assert "ours" in plain
    assert not any(name in plain for name in ("printed", "interval", "difference", "ratio", "note"))
    full, page = heads([Row("a", 0.5, 0.25, 0.2, 0.3, "noted"), Row("b", None, None)])
    assert all(name in full for name in ("printed", "interval", "difference", "ratio", "note"))
    assert '<td data-label="difference">−0.25</td><td data-label="ratio">0.5</td>' in page


def test_unknown_names_and_folders_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"table-9\.9"):
        reproduce(["table-9.9"], folder=tmp_path)
    with pytest.raises(InputError, match="does not exist"):
        reproduce(["table-2.1"], folder=tmp_path, data=tmp_path / "none")


def test_rows_carry_no_nan_and_students_interval():
    row = row_of("x", float("nan"), [1.0, 2.0, 3.0])
    assert row.printed is None
    # t(0.975, 2) = 4.3027, standard error 1 / sqrt(3)
    np.testing.assert_allclose([row.low, row.high], [2 - 4.302653 / 3**0.5, 2 + 4.302653 / 3**0.5], rtol=1e-6)
    assert row_of("x", 1.0, [3.0]).low is None


def test_pairs_without_data_share_a_part_and_their_boxes_correspond(tmp_path):
    pairs, said = image_pairs(Bench("x", tmp_path, quick=True))
    assert "synthetic" in said
    assert {pair.kind for pair in pairs} == set(LOOKS)
    for pair in pairs:
        for corner in (slice(0, 2), slice(2, 4)):
            carried = pair.homography @ [*pair.box1[corner], 1.0]
            np.testing.assert_allclose(carried[:2], pair.box2[corner], atol=1e-9)
        # All of the first picture, carried to the second and cut at its edges, is what they share.
        first = (pair.homography @ [0.0, 0.0, 1.0])[:2]
        last = (pair.homography @ [*pair.picture1.size, 1.0])[:2]
        shared = np.r_[np.maximum(first, 0), np.minimum(last, pair.picture2.size)]
        np.testing.assert_allclose(pair.box2, shared, atol=1e-9)
        areas = [float(np.prod(box[2:] - box[:2])) for box in (pair.box1, pair.box2)]
        sizes = [float(np.prod(picture.size)) for picture in (pair.picture1, pair.picture2)]
        assert 0.2 < sum(areas) / sum(sizes) < 0.97  # the whole is not the answer
    seen = next(pair for pair in pairs if pair.kind == "occlusion")
    parts = [
        picture.colour[int(box[1]) : int(box[3]), int(box[0]) : int(box[2])].astype(int)
        for picture, box in ((seen.picture1, seen.box1), (seen.picture2, seen.box2))
    ]
    assert (np.abs(parts[0] - parts[1]).max(axis=2) < 3).mean() > 0.5  # but for what is hidden, the same


def test_the_command_writes_a_report_and_speaks_json(tmp_path, capsys, monkeypatch):
    monkeypatch.delenv("PLIANT_DATA", raising=False)
    assert main(["reproduce", FAST, "--quick", "--json", "-o", str(tmp_path)]) == 0
    verdicts = json.loads(capsys.readouterr().out)
    assert verdicts[0]["name"] == FAST
    assert verdicts[0]["verdict"] in ("holds", "holds partly", "does not hold")
    rows = {row["name"]: row["ours"] for row in verdicts[0]["rows"]}
    area = next(v for name, v in rows.items() if name.startswith("area") and "below" in name)
    kernel = next(v for name, v in rows.items() if name.startswith("mean") and "below" in name)
    assert area < 0.3 < kernel
    assert main(["reproduce", "--list"]) == 0
    listed = capsys.readouterr().out.splitlines()
    assert any(line.split()[:1] == [FAST] for line in listed)
    named = [
        line for line in listed if line.split()[:1] and line.split()[0].startswith(("figure-", "table-"))
    ]
    assert len({re.match(r" *[a-z]+-[0-9.]+ +", line).end() for line in named}) == 1  # to the left


def test_the_command_says_why_an_experiment_is_not_tested(tmp_path, capsys, monkeypatch):
    monkeypatch.delenv("PLIANT_DATA", raising=False)
    assert main(["reproduce", "figure-6.6", "--quick", "-o", str(tmp_path)]) == 0
    assert "figure-6.6, not tested: It needs images/caltech101" in capsys.readouterr().out


def test_an_unknown_name_is_bad_usage_and_all_names_are_told(tmp_path):
    assert main(["reproduce", "table-9.9", "-o", str(tmp_path)]) == 2
    with pytest.raises(InputError, match=r"figure-2\.7, .*chapter-2, .*figure-2\.9 \(in figure-2\.8\)"):
        reproduce(["table-9.9"], folder=tmp_path)
