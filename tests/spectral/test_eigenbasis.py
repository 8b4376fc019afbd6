"""The eigenbasis: closed forms, parity with ARPACK, laws, determinism, cache, refusals."""

import hashlib
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.linalg import eigsh
from scipy.spatial import ConvexHull
from threadpoolctl import threadpool_info, threadpool_limits

from pliant import Mesh, shapes
from pliant.errors import FileFormatError, InputError, NumericalError, PliantWarning
from pliant.mesh import load_mesh
from pliant.spectral import Laplacian, Spectrum, cotan_laplacian, eigenbasis, laplacian


def check(spectrum: Spectrum, operator: Laplacian, tol: float = 1e-8) -> None:
    """Whatever a spectrum promises, measured anew."""
    x, values = spectrum.vectors, spectrum.values
    assert (np.diff(values) >= 0).all()
    assert values[0] == 0
    weighed = operator.mass @ x
    assert np.abs(x.T @ weighed - np.eye(spectrum.k)).max() < max(1e-9, 1e-3 * tol)
    scale = np.where(values > 0, values, values[spectrum.n_zero] if spectrum.k > spectrum.n_zero else 1)
    gap = np.linalg.norm(operator.stiffness @ x - weighed * values, axis=0)
    residuals = gap / scale / np.linalg.norm(weighed, axis=0)
    assert residuals.max() <= tol
    np.testing.assert_allclose(spectrum.residuals, residuals, rtol=0.5, atol=1e-10)
    assert spectrum.n_zero == min(operator.components()[0], spectrum.k)
    largest = np.abs(x).max(axis=0)
    first = np.argmax(np.abs(x) >= (1 - 1e-6) * largest, axis=0)
    assert (x[first, np.arange(spectrum.k)] > 0).all()


def by_arpack(operator: Laplacian, k: int) -> np.ndarray:
    shift = -0.1 / operator.area
    with threadpool_limits(1):
        values = eigsh(operator.stiffness, k, operator.mass, sigma=shift, return_eigenvectors=False)
    return np.maximum(np.sort(values), 0)


def repeated(mesh: Mesh, copies: int) -> Mesh:
    vertices = np.vstack([mesh.vertices + 5.0 * i for i in range(copies)])
    faces = np.vstack([mesh.faces + i * mesh.n_vertices for i in range(copies)])
    return Mesh(vertices, faces)


def test_sphere_has_l_times_l_plus_1_with_multiplicity():
    operator = laplacian(shapes.icosphere(4))
    spectrum = eigenbasis(operator, 100)
    check(spectrum, operator)
    degree = np.repeat(np.arange(10), 2 * np.arange(10) + 1)
    np.testing.assert_allclose(spectrum.values, degree * (degree + 1), rtol=0.05)


def test_sphere_converges_at_second_order():
    errors = [abs(eigenbasis(shapes.icosphere(s), 9).values[4:].mean() - 6) for s in (2, 3, 4)]
    rates = np.log2(np.divide(errors[:-1], errors[1:]))
    np.testing.assert_allclose(rates, 2, atol=0.15)


def torus_values(width: float, height: float, k: int) -> np.ndarray:
    p, q = np.meshgrid(np.arange(-40, 41), np.arange(-40, 41))
    return np.sort((4 * np.pi**2 * ((p / width) ** 2 + (q / height) ** 2)).ravel())[:k]


def grid_torus_values(n: int, k: int) -> np.ndarray:
    """On a right-angled grid the cotangent Laplacian is the five-point stencil, solved by Fourier."""
    wave = (2 * n * np.sin(np.pi * np.arange(n) / n)) ** 2
    return np.sort(np.add.outer(wave, wave).ravel())[:k]


@pytest.mark.parametrize("k", [5, 9, 21, 23, 45, 61])
def test_flat_torus_at_and_inside_clusters(flat_torus, k):
    operator = flat_torus(48, 48, 1.0, 1.0)
    spectrum = eigenbasis(operator, k)
    check(spectrum, operator)
    np.testing.assert_allclose(spectrum.values, torus_values(1, 1, k), rtol=0.04, atol=1e-12)
    # Shift-invert ARPACK misses copies here (two of the 21st value at k = 21); the stencil's values are exact.
    np.testing.assert_allclose(spectrum.values, grid_torus_values(48, k), rtol=1e-10, atol=1e-10)


def test_oblong_torus(flat_torus):
    spectrum = eigenbasis(flat_torus(96, 24, 4.0, 1.0), 40)
    np.testing.assert_allclose(spectrum.values, torus_values(4, 1, 40), rtol=0.03, atol=1e-12)


def test_square_with_free_border(irregular_square):
    mesh = irregular_square(4000, 0)
    p, q = np.meshgrid(np.arange(8), np.arange(8))
    expected = np.pi**2 * np.sort((p**2 + q**2).ravel())[:30]
    spectrum = eigenbasis(mesh, 30)
    check(spectrum, laplacian(mesh))
    np.testing.assert_allclose(spectrum.values, expected, rtol=0.015, atol=1e-12)
    first = spectrum.vectors[:, 1:3]
    exact = np.sqrt(2) * np.cos(np.pi * mesh.vertices[:, :2])
    overlap = exact.T @ spectrum.mass @ first
    np.testing.assert_allclose(np.linalg.svd(overlap, compute_uv=False), 1, atol=2e-3)


@pytest.mark.parametrize("k", [1, 2, 7, 60, 161])
def test_small_meshes(k):
    operator = laplacian(shapes.icosphere(2))
    spectrum = eigenbasis(operator, k)
    check(spectrum, operator)
    assert spectrum.k == k


@settings(max_examples=12)
@given(seed=st.integers(0, 10**6), n=st.integers(4, 800), share=st.floats(0.001, 0.999))
def test_random_meshes_agree_with_dense_lapack(seed, n, share):
    points = np.random.default_rng(seed).standard_normal((n, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    mesh = Mesh(points, ConvexHull(points).simplices)
    operator = laplacian(mesh)
    k = max(1, int(share * (n - 1)))
    spectrum = eigenbasis(operator, k, tol=1e-7)
    check(spectrum, operator, 1e-7)
    root = 1 / np.sqrt(operator.mass.diagonal())
    with threadpool_limits(1):
        dense = np.linalg.eigvalsh(root[:, None] * operator.stiffness.toarray() * root)[:k]
    np.testing.assert_allclose(spectrum.values, dense, rtol=1e-7, atol=1e-12 * dense[-1] + 1e-11)


def test_many_pairs_in_several_windows():
    operator = laplacian(shapes.bumpy_sphere(4, rng=1))
    spectrum = eigenbasis(operator, 400)
    check(spectrum, operator)
    expected = by_arpack(operator, 400)
    np.testing.assert_allclose(spectrum.values, expected, atol=1e-9 * expected[-1])


@pytest.mark.parametrize(("copies", "k"), [(2, 1), (2, 2), (3, 40), (40, 200)])
def test_pieces_have_their_own_zero_and_constant(copies, k):
    # Identical pieces: every value is repeated, 40 times more than a block of vectors is wide.
    mesh = repeated(shapes.icosphere(2), copies)
    operator = laplacian(mesh)
    spectrum = eigenbasis(operator, k)
    check(spectrum, operator)
    one = eigenbasis(shapes.icosphere(2), 20).values
    np.testing.assert_allclose(spectrum.values, np.repeat(one, copies)[:k], atol=1e-9 * one[-1])
    for column in spectrum.vectors[:, : spectrum.n_zero].T:
        inside = column != 0
        assert inside.sum() == 162
        assert np.unique(column[inside]).size == 1


def test_consistent_mass_brackets_the_sphere():
    lumped = eigenbasis(laplacian(shapes.icosphere(3)), 50)
    operator = laplacian(shapes.icosphere(3), mass="consistent")
    spectrum = eigenbasis(operator, 50)
    check(spectrum, operator)
    assert (spectrum.values[1:] > lumped.values[1:]).all()
    np.testing.assert_allclose(spectrum.values, by_arpack(operator, 50), atol=1e-8)


def test_mesh_kind_has_the_heat_operators_values(irregular_sphere):
    mesh = irregular_sphere(1000, 0)
    operator = laplacian(mesh, "mesh", bandwidth=0.02)
    spectrum = eigenbasis(operator, 16)
    check(spectrum, operator)
    degree = np.repeat(np.arange(4), 2 * np.arange(4) + 1)
    expected = (1 - np.exp(-degree * (degree + 1) * 0.02)) / 0.02
    np.testing.assert_allclose(spectrum.values, expected, rtol=0.06, atol=1e-12)


def test_scale_law():
    mesh = shapes.bumpy_sphere(3, rng=0)
    one, three = eigenbasis(mesh, 60), eigenbasis(mesh.scaled(3), 60)
    np.testing.assert_allclose(three.values, one.values / 9, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(three.vectors[:, :10], one.vectors[:, :10] / 3, atol=1e-6)


def test_isometry_leaves_the_spectrum():
    mesh = shapes.bumpy_sphere(3, rng=0)
    turned = mesh.transformed(np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]))
    np.testing.assert_allclose(eigenbasis(turned, 60).values, eigenbasis(mesh, 60).values, atol=1e-9)


DIGEST = """
import hashlib
from pliant import eigenbasis, shapes
s = eigenbasis(shapes.bumpy_sphere(4, rng=2), 40, n_jobs={jobs})
print(hashlib.sha256(s.values.tobytes() + s.vectors.tobytes()).hexdigest())
"""


def test_same_bytes_in_every_process_and_for_every_number_of_threads():
    digests = {
        subprocess.run(
            [sys.executable, "-c", DIGEST.format(jobs=jobs)], capture_output=True, text=True, check=True
        ).stdout
        for jobs in (1, 2, 3)
    }
    here = eigenbasis(shapes.bumpy_sphere(4, rng=2), 40)
    digests.add(hashlib.sha256(here.values.tobytes() + here.vectors.tobytes()).hexdigest() + "\n")
    assert len(digests) == 1


def test_input_is_left_alone_and_results_are_read_only():
    spectrum = eigenbasis(shapes.icosphere(3), 20)
    for array in (spectrum.values, spectrum.vectors, spectrum.residuals):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_cache(tmp_path, monkeypatch):
    mesh, folder = shapes.icosphere(3), tmp_path / "made" / "here"
    first = eigenbasis(mesh, 30, cache=folder)
    (file,) = folder.iterdir()
    monkeypatch.setattr("pliant.spectral.basis._computed", lambda *_, **__: pytest.fail("computed again"))
    again = eigenbasis(mesh, 30, cache=folder)
    assert again.vectors.tobytes() == first.vectors.tobytes()
    smaller = eigenbasis(mesh, 12, cache=folder)
    assert smaller.k == 12
    assert (smaller.vectors == first.vectors[:, :12]).all()
    monkeypatch.undo()
    assert eigenbasis(mesh, 40, cache=folder).k == 40
    assert list(folder.iterdir()) == [file]
    # Another geometry, operator, mass or tolerance is another entry.
    eigenbasis(mesh.scaled(2), 12, cache=folder)
    eigenbasis(mesh, 12, kind="robust", cache=folder)
    eigenbasis(laplacian(mesh, mass="consistent"), 12, cache=folder)
    eigenbasis(mesh, 12, tol=1e-6, cache=folder)
    assert len(list(folder.iterdir())) == 5


def test_damaged_cache_is_computed_again(tmp_path):
    mesh = shapes.icosphere(3)
    first = eigenbasis(mesh, 30, cache=tmp_path)
    (file,) = tmp_path.iterdir()
    whole = file.read_bytes()
    for broken in (b"", b"rubbish", whole[: len(whole) // 2], whole[:2000] + b"\xff" * 500 + whole[2500:]):
        file.write_bytes(broken)
        with pytest.warns(PliantWarning, match="computing the eigenbasis again"):
            again = eigenbasis(mesh, 30, cache=tmp_path)
        assert again.vectors.tobytes() == first.vectors.tobytes()
        assert file.read_bytes() == whole


@pytest.mark.parametrize("k", [0, -1, 162, 500, 2.5, True])
def test_k_out_of_range(k):
    with pytest.raises(InputError, match=r"k must be a whole number 1\.\.161"):
        eigenbasis(shapes.icosphere(2), k)


@pytest.mark.parametrize("tol", [0, -1, 1, np.nan])
def test_tol_out_of_range(tol):
    with pytest.raises(InputError, match="tol must"):
        eigenbasis(shapes.icosphere(2), 5, tol=tol)


def test_unreachable_tolerance_says_so():
    with pytest.raises(NumericalError, match="tol"):
        eigenbasis(shapes.icosphere(3), 20, tol=1e-19)


def test_failure_points_at_the_slivers():
    mesh = shapes.icosphere(3)
    vertices = mesh.vertices.copy()
    a, b, c = mesh.faces[0]
    vertices[a] = 0.5 * (vertices[b] + vertices[c]) + 1e-8 * vertices[a]
    with pytest.raises(NumericalError, match="sliver triangles") as caught:
        eigenbasis(Mesh(vertices, mesh.faces), 50, tol=1e-12)
    assert str(a) in str(caught.value)


def test_tolerance_is_kept():
    operator = laplacian(shapes.bumpy_sphere(4, rng=1))
    for tol in (1e-4, 1e-10):
        check(eigenbasis(operator, 80, tol=tol), operator, tol)


def test_spectrum_projects_and_reconstructs(tmp_path):
    mesh = shapes.icosphere(3)
    spectrum = eigenbasis(mesh, 49)
    f = mesh.vertices[:, 0] * mesh.vertices[:, 1] + mesh.vertices[:, 2]
    back = spectrum.reconstruct(spectrum.project(f))
    assert np.abs(back - f).max() < 2e-3
    c = np.random.default_rng(0).standard_normal((49, 3))
    np.testing.assert_allclose(spectrum.project(spectrum.reconstruct(c)), c, atol=1e-12)
    assert spectrum.area == pytest.approx(mesh.area)
    assert spectrum.truncated(5).values.tolist() == spectrum.values[:5].tolist()
    spectrum.save(tmp_path / "s.npz")
    loaded = Spectrum.load(tmp_path / "s.npz")
    for name in ("values", "vectors", "residuals"):
        assert getattr(loaded, name).tobytes() == getattr(spectrum, name).tobytes()
    assert (loaded.mass != spectrum.mass).nnz == 0
    assert [p.name for p in tmp_path.iterdir()] == ["s.npz"]


def test_spectrum_refusals(tmp_path):
    spectrum = eigenbasis(shapes.icosphere(2), 9)
    for k in (0, 10):
        with pytest.raises(InputError, match=r"1\.\.9"):
            spectrum.truncated(k)
    with pytest.raises(InputError, match="162 rows"):
        spectrum.project(np.zeros(5))
    with pytest.raises(InputError, match="at most 9"):
        spectrum.reconstruct(np.zeros(10))
    with pytest.raises(InputError, match="ascend"):
        Spectrum([1, 0], np.eye(2), sp.eye_array(2))
    with pytest.raises(InputError, match=r"values must be \(k,\)"):
        Spectrum([0, 1], np.eye(3), sp.eye_array(3))
    with pytest.raises(FileNotFoundError):
        Spectrum.load(tmp_path / "none.npz")
    np.savez(tmp_path / "other.npz", x=np.arange(3))
    with pytest.raises(FileFormatError, match="not a stored spectrum"):
        Spectrum.load(tmp_path / "other.npz")


def test_repeated_edge_of_nothing_is_not_a_piece_apart():
    # Two triangles that share an edge whose weight is zero hang together all the same.
    operator = cotan_laplacian([[1, 1, 2**0.5], [1, 1, 2**0.5]], [[0, 1, 2], [1, 0, 3]])
    assert eigenbasis(operator, 3).n_zero == 1


def test_wide_rows_with_a_full_mass_still_count_the_mass(monkeypatch):
    operator = laplacian(shapes.bumpy_sphere(4, rng=1), mass="consistent")
    expected = eigenbasis(operator, 30)
    monkeypatch.setattr("pliant.spectral.basis._WIDEST_ROWS", 3)
    np.testing.assert_allclose(eigenbasis(operator, 30).values, expected.values, rtol=1e-9, atol=1e-12)
    lumped = laplacian(shapes.bumpy_sphere(3, rng=1))
    factorless = eigenbasis(lumped, 30)
    monkeypatch.undo()
    np.testing.assert_allclose(eigenbasis(lumped, 30).values, factorless.values, rtol=1e-8, atol=1e-12)


def test_threads_side_by_side_agree_and_leave_blas_as_it_was():
    def blas_threads() -> list[int]:
        return [pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"]

    before, mesh = blas_threads(), shapes.bumpy_sphere(4, rng=2)
    with ThreadPoolExecutor(3) as pool:
        results = list(pool.map(lambda _: eigenbasis(mesh, 30).vectors.tobytes(), range(4)))
    assert len(set(results)) == 1
    assert blas_threads() == before


@pytest.mark.data
@pytest.mark.parametrize("kind", ["cotan", "robust"])
def test_real_meshes_agree_with_arpack(data, kind):
    for name in ("wolf0", "cat1"):
        operator = laplacian(load_mesh(data / "shapes" / "tosca_remeshed_5k" / f"{name}.ply"), kind)
        spectrum = eigenbasis(operator, 120)
        check(spectrum, operator)
        expected = by_arpack(operator, 120)
        np.testing.assert_allclose(spectrum.values, expected, atol=1e-9 * expected[-1])
