"""Partial matching: exact truth of synthetic pairs, laws, pairs in which there is nothing to find, real pairs."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter

from pliant.errors import InputError
from pliant.evaluate.relevance import transform_error
from pliant.images import (
    as_picture,
    best_rectangle,
    evaluate_pairs,
    match_blur,
    match_centre,
    match_keypoints,
    match_pair,
    match_saliency,
    match_whole,
    moved,
    read_pairs,
    registrations,
    repeated_matches,
    shipped_photographs,
    smallest_rectangle,
    synthetic_pair,
    synthetic_pairs,
    unrelated_scores,
)

pytest.importorskip("cv2")
pytest.importorskip("skimage")

small_maps = st.lists(st.lists(st.integers(-5, 5), min_size=5, max_size=5), min_size=1, max_size=6)


def every_rectangle(gains):
    height, width = gains.shape
    return max(
        gains[a:b, c:d].sum()
        for a in range(height)
        for b in range(a + 1, height + 1)
        for c in range(width)
        for d in range(c + 1, width + 1)
    )


@given(small_maps)
def test_best_rectangle_is_the_best_of_all(rows):
    gains = np.array(rows, dtype=float)
    (x0, y0, x1, y1), total = best_rectangle(gains)
    assert total == max(every_rectangle(gains), 0)
    assert gains[y0:y1, x0:x1].sum() == total


@given(st.integers(0, 1000), st.floats(0.5, 0.95))
@settings(max_examples=15)
def test_smallest_rectangle_holds_its_share(seed, share):
    evidence = gaussian_filter(np.random.default_rng(seed).random((31, 42)) ** 4, 2)
    (x0, y0, x1, y1), price = smallest_rectangle(evidence, share)
    assert evidence[y0:y1, x0:x1].sum() >= share * evidence.sum()
    # It is the best at its price: no rectangle earns more.
    assert best_rectangle(evidence - price)[1] == pytest.approx((evidence[y0:y1, x0:x1] - price).sum())


def test_no_evidence_gives_an_empty_rectangle():
    assert smallest_rectangle(np.zeros((4, 5)), 0.9) == ((0, 0, 0, 0), 0.0)
    with pytest.raises(InputError, match="share"):
        smallest_rectangle(np.ones((4, 5)), 1.5)


@given(st.floats(0.4, 2.5), st.floats(-0.7, 0.7), st.integers(0, 100))
@settings(max_examples=20)
def test_registration_finds_a_similarity_under_outliers(scale, angle, seed):
    rng = np.random.default_rng(seed)
    one = rng.uniform(0, 200, (60, 2))
    linear = scale * np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    two = one @ linear.T + [20, -30] + rng.normal(0, 0.5, (60, 2))
    two[30:] = rng.uniform(two.min(), two.max(), (30, 2))
    best = registrations(one, two, 5.0)[0]
    assert np.allclose(best.transform[:2, :2], linear, atol=0.05 * scale)
    assert best.inliers[:30].all()


def test_registration_of_too_little_is_empty():
    assert registrations([[0, 0], [5, 5]], [[0, 0], [5, 5]], 1.0) == []
    assert registrations(np.zeros((5, 2)), np.zeros((5, 2)), 1.0) == []
    with pytest.raises(InputError, match="tolerance"):
        registrations(np.zeros((5, 2)), np.zeros((5, 2)), 0)


def scene(seed=0, height=240, width=320):
    values = gaussian_filter(np.random.default_rng(seed).random((height, width)), 4)
    return (values - values.min()) / np.ptp(values)


@pytest.mark.parametrize(
    "kind", ["crop", "rotation", "scale", "occlusion", "night", "haze", "drawing", "painting"]
)
def test_synthetic_truth_is_found(kind):
    pair = synthetic_pair(shipped_photographs()["coffee"], kind, name="coffee", rng=3)
    match = match_pair(pair.picture1, pair.picture2)
    error = transform_error(match.transform, pair.homography, pair.box1, pair.picture2.size)
    assert error < 0.02, kind
    assert match.score > 10
    assert len(match.points1) == len(match.points2) == len(match.distances) > match.score


def test_truth_of_synthetic_pairs_is_exact():
    """A white dot goes where the homography says."""
    dots = np.zeros((200, 240), np.uint8)
    dots[60, 90] = dots[130, 150] = 255
    dots = gaussian_filter(dots.astype(float), 2)
    dots = dots / dots.max()
    for kind in ("crop", "rotation", "scale", "perspective"):
        pair = synthetic_pair(as_picture(dots, mask=np.ones(dots.shape)), kind, rng=5)
        for x, y in ((90, 60), (150, 130)):
            expected = pair.homography @ [x, y, 1]
            u, v = expected[:2] / expected[2]
            height, width = pair.picture2.grey.shape
            if not (8 < u < width - 8 and 8 < v < height - 8):
                continue
            a, b = round(v), round(u)
            part = pair.picture2.grey[a - 7 : a + 8, b - 7 : b + 8]
            rows, columns = np.mgrid[a - 7 : a + 8, b - 7 : b + 8]
            centre = np.array([(part * columns).sum(), (part * rows).sum()]) / part.sum()
            assert np.allclose(centre, [u, v], atol=0.3), kind


@pytest.mark.parametrize("kind", ["haze", "drawing", "engraving"])
def test_a_change_of_look_draws_no_frame(kind):
    """A border that only the change made would be shared evidence for nothing."""
    flat = np.full((200, 240), 0.6)
    flat[60:140, 80:160] = 0.3
    pair = synthetic_pair(flat, kind, rng=0)
    second = gaussian_filter(pair.picture2.grey, 4)
    assert abs(second[2:6, 100:140].mean() - second[30:40, 100:140].mean()) < 0.12


def test_moving_a_pair_carries_its_truth():
    pair = synthetic_pair(scene(), "haze", rng=0)
    for seed in range(4):
        away = moved(pair, rng=seed)
        assert 0.5 <= away.notes["scale"] <= 1.4
        assert abs(away.notes["turn"]) <= 15
        assert not away.picture2.mask.all()
        match = match_pair(away.picture1, away.picture2)
        assert transform_error(match.transform, away.homography, away.box1, away.picture2.size) < 0.03
    still = moved(pair, turn=0, scales=(1.0, 1.0))
    assert np.allclose(still.box2, pair.box2)
    assert np.array_equal(still.picture2.colour, pair.picture2.colour)


def test_same_seed_same_bytes_and_other_seed_other_points():
    one, two = scene(), scene()[20:220, 40:300]
    first, again, other = match_pair(one, two), match_pair(one, two), match_pair(one, two, rng=7)
    assert first.points1.tobytes() == again.points1.tobytes()
    assert first.box1.tobytes() == again.box1.tobytes()
    assert not np.array_equal(first.points1, other.points1)


def test_boxes_do_not_depend_on_resolution():
    from pliant.images._opencv import resized

    pair = synthetic_pair(shipped_photographs()["camera"], "haze", rng=0)
    grey = pair.picture1.grey
    large = np.clip(resized(grey, 2 * grey.shape[1], 2 * grey.shape[0]), 0, 1)
    here, there = match_pair(grey, grey), match_pair(large, large)
    assert np.allclose(2 * here.box1, there.box1, atol=0.05 * 1024)


def test_a_smaller_share_gives_smaller_boxes_and_intensity_can_be_weighed():
    pair = synthetic_pair(shipped_photographs()["camera"], "haze", rng=0)
    boxes = [match_pair(pair.picture1, pair.picture2, share=s).box1 for s in (0.6, 0.9)]
    areas = [(b[2] - b[0]) * (b[3] - b[1]) for b in boxes]
    assert areas[0] < areas[1]
    weighed = match_pair(pair.picture1, pair.picture2, intensity_weight=1.0)
    assert weighed.settings["intensity_weight"] == 1.0
    assert weighed.region1.sum() != match_pair(pair.picture1, pair.picture2).region1.sum()


NOTHING = {
    "one pixel": np.full((1, 1), 0.5),
    "uniform": np.full((100, 120), 0.5),
    "black": np.zeros((100, 120)),
    "a few pixels": np.random.default_rng(0).random((9, 300)),
}


@pytest.mark.parametrize("what", NOTHING)
@pytest.mark.parametrize("turn", [False, True])
def test_nothing_to_match_gives_score_0_and_the_reason(what, turn):
    pair = (NOTHING[what], scene())
    match = match_pair(*(pair[::-1] if turn else pair))
    assert match.score == 0
    assert match.transform is None
    assert not match.box1.any()
    assert f"image {2 if turn else 1}" in match.reason
    for baseline in (match_blur, match_saliency, match_keypoints, match_whole, match_centre):
        assert baseline(*(pair[::-1] if turn else pair)).score == 0 or baseline is match_blur


def test_an_empty_mask_gives_the_reason():
    match = match_pair(scene(), scene(1), mask2=np.zeros((240, 320)))
    assert "mask" in match.reason


def test_unrelated_pictures_score_low():
    pairs = [synthetic_pair(scene(s), "haze", name=f"scene{s}", rng=s) for s in range(3)]
    unrelated, area, true = unrelated_scores(pairs, count=4)
    assert area == 1.0
    assert unrelated.max() < 0.5 * true.min()


def test_options_are_checked():
    for options in ({"features": 2}, {"dim": 0}, {"share": 1.0}, {"intensity_weight": -1}):
        with pytest.raises(InputError, match="features must be"):
            match_pair(scene(), scene(), **options)


@pytest.mark.parametrize("detector", ["sift", "orb", "fast", "akaze"])
@pytest.mark.parametrize("box", ["matched", "ransac"])
def test_key_points_find_an_easy_crop(detector, box):
    photograph = shipped_photographs()["astronaut"]
    match = match_keypoints(photograph, photograph[100:400, 50:450], detector=detector, box=box)
    assert match.score > 50
    if box == "ransac":
        assert np.allclose(match.transform, [[1, 0, -50], [0, 1, -100], [0, 0, 1]], atol=2)
        assert match.box1[0] >= 45
        assert match.box1[3] <= 405


def test_boxes_that_look_at_nothing():
    mask = np.zeros((100, 200))
    mask[20:80, 50:150] = 1
    whole = match_whole(np.ones((100, 200)) / 2, np.ones((50, 50)) / 2, mask1=mask)
    assert whole.box1.tolist() == [50, 20, 150, 80]
    assert whole.region1.sum() == 6000
    assert match_centre(np.ones((100, 200)) / 2, np.ones((50, 50)) / 2).box2.tolist() == [
        3.75,
        3.75,
        46.25,
        46.25,
    ]


def test_study_of_synthetic_pairs():
    photographs = {name: shipped_photographs()[name] for name in ("camera", "coffee")}
    pairs = list(synthetic_pairs(photographs, kinds=("crop", "night")))
    study = evaluate_pairs(pairs, methods=("proposed", "gb", "whole"))
    assert set(study.mrs()) == {"proposed", "gb", "whole"}
    assert study.transform_share() == 1.0
    summary = json.loads(json.dumps(study.summary(), allow_nan=False))
    assert summary["by_kind"]["crop"]["pairs"] == 2
    assert set(summary["by_monument"]) == {"camera", "coffee"}
    assert summary["by_registration"]["registered"]["pairs"] == 2
    again = evaluate_pairs(pairs, methods=("proposed", "gb", "whole"), n_jobs=2)
    assert np.array_equal(again.scores["proposed"].relevance, study.scores["proposed"].relevance)
    with pytest.raises(InputError, match="methods"):
        evaluate_pairs(pairs, methods=("proposed", "magic"))


def test_repeated_runs_overlap():
    pair = synthetic_pair(shipped_photographs()["coffee"], "haze", rng=0)
    assert repeated_matches(pair, runs=4)["overlap"] > 0.8


def test_lists_of_pairs_are_checked(tmp_path):
    path = tmp_path / "pairs.json"
    for text, words in (
        ("{", "not JSON"),
        ("[]", "list of records"),
        ('[{"image1": "a"}]', "record 0: image2, box1, box2, homography missing"),
        (
            '[{"image1":"a","image2":"b","box1":[1],"box2":[0,0,1,1],"homography":[1,0,0,0,1,0,0,0,1]}]',
            "box1 must be 4",
        ),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=words):
            read_pairs(path)


@pytest.mark.data
def test_real_pairs_are_registered_and_beat_the_baselines_that_look_at_nothing(data):
    records = read_pairs(data / "images" / "symd" / "pairs.json")
    assert len(records) == 24
    assert len({r.monument for r in records}) == 14
    chosen = [r for r in records if r.name in ("bank", "bdom", "eiffel", "londonbridge", "stargarder")]
    study = evaluate_pairs(chosen, methods=("proposed", "whole", "centre"))
    assert study.transform_share() == 1.0
    assert study.mrs()["proposed"] > study.mrs()["centre"] + 0.1 > study.mrs()["whole"]
