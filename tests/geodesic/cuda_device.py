"""The device's engine against the CPU's; run by test_cuda.py in a process of its own, simulated or on a real device."""

from __future__ import annotations

import json
import os
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse.csgraph as csgraph
from numba import cuda
from numpy.typing import NDArray

import pliant
from pliant import EdgeGraph, GeodesicHierarchy, Mesh
from pliant.cli import main
from pliant.geodesic import cuda as engine
from pliant.geodesic import cuda_flow_kernels, cuda_kernels, cuda_propagate
from pliant.geodesic import hierarchy as solver_module
from pliant.geodesic.distances import FEW_SOURCES

SIMULATED = os.environ.get("NUMBA_ENABLE_CUDASIM") == "1"
Floats = NDArray[np.float64]


if SIMULATED:
    from numba.cuda.simulator import kernelapi
    from numba.np.numpy_support import as_dtype

    _allocating = threading.Lock()

    def shared_array(self: Any, shape: Any, dtype: Any, alignment: None = None) -> NDArray[Any]:
        """Give a block's threads one array for each line that asks; the simulator's own may give two."""
        frame = sys._getframe(1)
        line = frame.f_code.co_filename, frame.f_lineno
        with _allocating:
            if line not in self._allocations:
                self._allocations[line] = np.empty(shape, as_dtype(dtype))
        found: NDArray[Any] = self._allocations[line]
        return found

    kernelapi.FakeCUDAShared.array = shared_array
    # Its threads wait for one another at every turn: hand over the interpreter at once.
    sys.setswitchinterval(1e-6)


@pytest.fixture(autouse=True)
def swept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solver_module, "SMALLEST_SWEPT", 0)


def pieces() -> Mesh:
    """Two closed surfaces of different size, and a vertex of no face."""
    one, two = pliant.shapes.icosphere(0), pliant.shapes.platonic("octahedron")
    vertices = np.concatenate([one.vertices, two.vertices * 3 + 5, [[20, 0, 0]]])
    return Mesh(vertices, np.concatenate([one.faces, two.faces + one.n_vertices]))


def star(leaves: int) -> EdgeGraph:
    edges = np.column_stack([np.zeros(leaves, int), np.arange(1, leaves + 1)])
    return EdgeGraph(leaves + 1, edges, np.linspace(1, 2, leaves))


def path(n: int) -> EdgeGraph:
    return EdgeGraph(n, np.column_stack([np.arange(n - 1), np.arange(1, n)]), np.ones(n - 1))


SHAPES = {
    "sphere": lambda: pliant.shapes.bumpy_sphere(1, rng=3),
    "ties": lambda: pliant.shapes.grid(4, 4),
    "pieces": pieces,
    "star": lambda: star(12),
    "path": lambda: path(25),
    "one vertex": lambda: path(1),
}
BUSY = ["ties", "pieces", "star"]


@pytest.fixture(params=list(SHAPES))
def solver(request: pytest.FixtureRequest) -> GeodesicHierarchy:
    return GeodesicHierarchy(SHAPES[request.param]())


@pytest.fixture(params=BUSY)
def busy(request: pytest.FixtureRequest) -> GeodesicHierarchy:
    return GeodesicHierarchy(SHAPES[request.param]())


def little_memory(monkeypatch: pytest.MonkeyPatch, solver: GeodesicHierarchy) -> None:
    """Leave room for 32 sources at once."""
    lane = 20 * solver.n_vertices + 24 * solver.n_vertices + 16
    monkeypatch.setattr(engine, "_free_bytes", lambda: 34 * lane / 0.9)


def same(found: Floats, expected: Floats) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * max(1.0, expected.max()))


def test_distances_are_the_cpus_to_the_last_bit(solver: GeodesicHierarchy) -> None:
    sources = np.random.default_rng(0).integers(0, solver.n_vertices, 12)
    on_device = solver.distances(sources, device="cuda")
    np.testing.assert_array_equal(on_device, solver.distances(sources))
    limit = 0.4 * on_device[np.isfinite(on_device)].max()
    np.testing.assert_array_equal(
        solver.distances(sources, device="cuda", max_distance=limit),
        solver.distances(sources, max_distance=limit),
    )


def test_fixed_point_distances_by_either_kernel_are_dijkstras(
    solver: GeodesicHierarchy, monkeypatch: pytest.MonkeyPatch
) -> None:
    lengths = solver._fixed_lengths.astype(float)
    whole = EdgeGraph(solver.n_vertices, solver.graph.edges, lengths)
    sources = np.arange(0, solver.n_vertices, 4)
    expected = csgraph.dijkstra(whole.matrix(), directed=False, indices=sources)
    expected = np.where(np.isfinite(expected), expected, 2**30 - 1).astype(np.int32)
    np.testing.assert_array_equal(engine.fixed_point_distances(solver, sources), expected)
    # Small patches and few steps: changes have to travel through many blocks and launches.
    monkeypatch.setattr(cuda_propagate, "PATCH", 7)
    if SIMULATED:
        monkeypatch.setattr(cuda_propagate, "STEPS", 2)
        monkeypatch.setattr(cuda_propagate, "SHARED_EDGES", 9)
    np.testing.assert_array_equal(engine.fixed_point_distances(solver, sources, method="propagate"), expected)


def test_betweenness_agrees_and_is_the_same_bytes_again(busy: GeodesicHierarchy) -> None:
    rng = np.random.default_rng(1)
    forth, back = rng.random(busy.n_vertices), rng.random(busy.n_vertices)
    found = busy.betweenness(forth, back, device="cuda")
    same(found, busy.betweenness(forth, back))
    if busy.graph.n_edges < 15:
        assert found.tobytes() == busy.betweenness(forth, back, device="cuda").tobytes()


def test_edge_flow_in_slabs_from_sources_listed_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    solver = GeodesicHierarchy(pliant.shapes.grid(3, 4))
    sources = np.random.default_rng(0).integers(0, 12, 40)
    expected = solver.edge_flow(sources=sources)
    little_memory(monkeypatch, solver)
    same(solver.edge_flow(sources=sources, device="cuda"), expected)


def test_pairs_met_once_over_several_slabs(monkeypatch: pytest.MonkeyPatch) -> None:
    solver = GeodesicHierarchy(pliant.shapes.grid(4, 9))
    expected = solver.betweenness()
    little_memory(monkeypatch, solver)
    same(solver.betweenness(device="cuda"), expected)


def test_sampled_betweenness_agrees(busy: GeodesicHierarchy) -> None:
    rng = np.random.default_rng(2)
    weights, stands_for = rng.random(busy.n_vertices), 1 + rng.random(busy.n_vertices)
    groups = [rng.integers(0, busy.n_vertices, 6) for _ in range(2)]
    same(
        busy.sampled_betweenness(groups, weights, stands_for, device="cuda"),
        busy.sampled_betweenness(groups, weights, stands_for),
    )


def test_counts_that_overflow_are_damped(monkeypatch: pytest.MonkeyPatch) -> None:
    solver = GeodesicHierarchy(pliant.shapes.grid(3, 4, diagonal="same"))
    expected = solver.betweenness()
    if SIMULATED:
        monkeypatch.setattr(cuda_kernels, "LARGEST_COUNT", 2.0)
        tried: list[float] = []
        damped = solver._damped
        monkeypatch.setattr(solver, "_damped", lambda bits: tried.append(bits) or damped(bits))
        same(solver.betweenness(device="cuda"), expected)
        assert tried
    else:
        same(solver.betweenness(device="cuda"), expected)


def test_fields(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    mesh = pliant.shapes.grid(3, 4)
    for weights in ("area", "uniform"):
        same(pliant.gfe(mesh, weights=weights, device="cuda"), pliant.gfe(mesh, weights=weights))  # type: ignore[arg-type]
    many = np.arange(FEW_SOURCES + 1) % mesh.n_vertices
    np.testing.assert_array_equal(
        pliant.geodesic_distances(mesh, many, method="refined", device="cuda"),
        pliant.geodesic_distances(mesh, many, method="refined"),
    )
    pliant.save_mesh(tmp_path / "grid.ply", mesh)
    assert main(["field", str(tmp_path / "grid.ply"), "--device", "cuda", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["device"] == "cuda"
    assert said["gfe"]["greatest"] == pytest.approx(pliant.gfe(mesh).max())


def test_a_device_too_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine, "_free_bytes", lambda: 1000.0)
    solver = GeodesicHierarchy(path(40))
    with pytest.raises(pliant.UnavailableError, match="MiB"):
        solver.betweenness(device="cuda")


@cuda.jit
def total(values, out):  # type: ignore[no-untyped-def]
    partial = cuda.shared.array(8, cuda_flow_kernels.float64)
    found = cuda_kernels.block_sum(values[cuda.threadIdx.x], partial)
    if cuda.threadIdx.x == 0:
        out[0] = found


@pytest.mark.parametrize("threads", [1, 2, 8])
def test_blocks_add_up_whatever_their_size(threads: int) -> None:
    # The simulator's blocks have four threads; a device's have more.
    values = np.arange(1.0, threads + 1)
    out = cuda.to_device(np.zeros(1))
    total[1, threads](cuda.to_device(values), out)
    assert out.copy_to_host()[0] == values.sum()
