"""Cohorts of phantom hearts with known stenosis, and what is measured on their true surfaces."""

from __future__ import annotations

from functools import cache

from .._arrays import FloatArray
from ..heart import SegmentFeatures, aha_segments, endocardial_features, phantom_cohort, ventricle_frame
from .bench import Bench

DATA = (
    "{count} phantom hearts with known stenosis and {change} changes of the trabeculae (no public data "
    "carry stenosis by segment), from their exact surfaces. Ours is balanced accuracy, so that guessing "
    "has .5; intervals over subjects."
)
_STEP = {True: 1.5, False: 1.0}


def hearts(bench: Bench, change: str = "mixed") -> tuple[list[SegmentFeatures], FloatArray, str]:
    """Return features and per cent of stenosis (LAD, LCX, RCA) of each subject, and what to say of them."""
    count = 24 if bench.quick else 64
    features, stenosis = _measured(count, change, bench.seed + 1000, _STEP[bench.quick])
    return features, stenosis, DATA.format(count=count, change=change)


@cache
def _measured(count: int, change: str, seed: int, step: float) -> tuple[list[SegmentFeatures], FloatArray]:
    # The volumes are not used: the coarsest that can be made will do.
    cohort = phantom_cohort(count, change=change, rng=seed, mesh_step=step, spacing=8.0)  # type: ignore[arg-type]
    found = []
    for i, phantom in enumerate(cohort):
        landmarks = phantom.landmarks
        frame = ventricle_frame(
            phantom.mesh, apex=landmarks["apex"], base=landmarks["base"], septum=landmarks["septum"]
        )
        labels = aha_segments(phantom.mesh, frame)
        found.append(endocardial_features(phantom.mesh, labels, frame, points=200, rng=i))
    return found, cohort.stenosis
