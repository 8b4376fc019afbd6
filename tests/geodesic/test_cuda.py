"""The CUDA engine: in the simulator, in a process of its own; its planning; what is said where there is no device."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numba.cuda
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import pliant
from pliant import GeodesicHierarchy
from pliant.cli import main
from pliant.geodesic.cuda_plan import MOST_LANES, USABLE, WARP, lanes_that_fit, levels_of, nbytes

SUITE = Path(__file__).with_name("cuda_device.py")


@pytest.mark.parametrize("simulated", [True, False] if numba.cuda.is_available() else [True])
def test_device_suite(simulated: bool) -> None:
    environment = os.environ | {"NUMBA_ENABLE_CUDASIM": str(int(simulated)), "OMP_NUM_THREADS": "1"}
    environment["PYTEST_ADDOPTS"] = "-q"
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", str(SUITE)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-2000:]
    counted = re.search(r"(\d+) passed", done.stdout)
    assert counted
    assert int(counted[1]) >= 24
    assert "skipped" not in done.stdout


def no_device(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.cuda, "is_available", lambda: False)


def test_no_device_is_said_with_the_remedy(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    no_device(monkeypatch)
    mesh = pliant.shapes.icosphere(1)
    for call in (
        lambda: pliant.gfe(mesh, device="cuda"),
        lambda: pliant.estimate_gfe(mesh, 32, device="cuda"),
        lambda: pliant.geodesic_distances(mesh, [0], device="cuda"),
        lambda: GeodesicHierarchy(mesh).edge_flow(device="cuda"),
    ):
        with pytest.raises(pliant.UnavailableError, match="nvidia-smi"):
            call()


def test_no_device_at_the_shell(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    no_device(monkeypatch)
    pliant.save_mesh(tmp_path / "m.ply", pliant.shapes.icosphere(1))
    assert main(["field", str(tmp_path / "m.ply"), "--device", "cuda"]) == 3
    assert "no CUDA device can be used" in capsys.readouterr().err
    assert main(["field", str(tmp_path / "m.ply"), "--device", "tpu"]) == 2


def test_the_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba_cuda", None)
    with pytest.raises(pliant.MissingExtraError, match=r"pliant\[gpu\]"):
        pliant.gfe(pliant.shapes.icosphere(1), device="cuda")


def test_wrong_devices() -> None:
    mesh = pliant.shapes.icosphere(1)
    with pytest.raises(pliant.InputError, match="device must be"):
        pliant.gfe(mesh, device="tpu")  # type: ignore[arg-type]
    with pytest.raises(pliant.InputError, match="graph"):
        pliant.geodesic_distances(mesh, [0], method="heat", device="cuda")


@given(
    st.integers(1, 200_000),
    st.floats(1e6, 1e12),
    st.integers(0, 10**6),
    st.integers(1, 10**7),
)
def test_what_is_planned_fits(wanted: int, free: float, fixed: int, per_lane: int) -> None:
    try:
        lanes = lanes_that_fit(wanted, free=free, fixed=fixed, per_lane=per_lane)
    except pliant.UnavailableError:
        assert fixed + min(wanted, WARP) * per_lane > USABLE * free
        return
    assert 1 <= lanes <= min(wanted, MOST_LANES)
    assert fixed + lanes * per_lane <= USABLE * free
    if lanes < min(wanted, MOST_LANES):
        assert lanes % WARP == 0
        # Slabs of nearly equal size, and no more of them than the memory asks for.
        most = int((USABLE * free - fixed) // per_lane) // WARP * WARP
        assert -(-wanted // lanes) <= -(-wanted // min(most, MOST_LANES))


def test_plans_by_example() -> None:
    assert lanes_that_fit(100, free=np.inf, fixed=0, per_lane=10) == 100
    assert lanes_that_fit(10**6, free=np.inf, fixed=0, per_lane=10) == MOST_LANES
    # 0.9 x 1000 - 100 leaves 800 bytes: 80 lanes of 10, in warps 64.
    assert lanes_that_fit(200, free=1000, fixed=100, per_lane=10) == 64
    assert lanes_that_fit(65, free=600 / 0.9, fixed=0, per_lane=10) == 32
    with pytest.raises(pliant.UnavailableError, match='device="cpu"'):
        lanes_that_fit(33, free=100, fixed=0, per_lane=10)
    assert nbytes(np.zeros(3), np.zeros(2, np.int32)) == 32


def test_levels_come_before_those_that_need_them() -> None:
    solver = GeodesicHierarchy(pliant.shapes.grid(9, 11))
    skeleton, arcs = solver._skeleton, solver._counted()
    plan = levels_of(skeleton, arcs)
    level = np.empty(solver.n_vertices, int)
    for i, (start, stop) in enumerate(zip(plan.starts[:-1], plan.starts[1:], strict=True)):
        level[plan.vertices[start:stop]] = i
    tails = np.repeat(np.arange(solver.n_vertices), np.diff(arcs.rows))
    assert (level[tails] > level[arcs.heads]).all()
    np.testing.assert_array_equal(np.sort(plan.vertices), np.arange(solver.n_vertices))
    # Ancestors by parent and by place in the order are the same.
    for s in range(solver.n_vertices):
        v, above = s, []
        while v >= 0:
            above.append(v)
            v = int(plan.parent[v])
        everyone = np.arange(solver.n_vertices)
        np.testing.assert_array_equal(
            np.flatnonzero((everyone - plan.size < s) & (s <= everyone)), np.sort(above)
        )
        np.testing.assert_array_equal(plan.depth[above], np.arange(len(above))[::-1])
    order = np.lexsort((tails, arcs.heads))
    np.testing.assert_array_equal(plan.lower, tails[order])
    np.testing.assert_array_equal(plan.lower_arcs, order)
    spans = plan.from_rank(40)
    assert sum(stop - first for first, stop in spans) == solver.n_vertices - 40
    assert all((plan.vertices[first:stop] >= 40).all() for first, stop in spans)
