"""Laplacians: known matrices, laws of the operator, convergence, refusals."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from hypothesis import strategies as st

from pliant import Mesh, MeshError, shapes
from pliant.errors import InputError
from pliant.spectral import Laplacian, cotan_laplacian, laplacian

KINDS = ("cotan", "robust", "mesh")


def rotation(seed: int) -> np.ndarray:
    q, r = np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))
    return q * np.sign(np.diag(r))


@pytest.mark.parametrize("kind", KINDS)
def test_operator_laws(kind, irregular_sphere):
    operator = laplacian(irregular_sphere(300, 1), kind)
    dense = operator.stiffness.toarray()
    assert np.abs(dense - dense.T).max() <= 1e-14 * np.abs(dense).max()
    assert np.abs(dense.sum(axis=1)).max() < 1e-12 * np.abs(dense).max()
    assert np.linalg.eigvalsh(dense)[0] > -1e-12 * np.abs(dense).max()
    assert (operator.mass.diagonal() > 0).all()
    assert operator.lumped
    assert isinstance(operator.stiffness, sp.csr_array)
    with pytest.raises(ValueError, match="read-only"):
        operator.stiffness.data[0] = 1


@pytest.mark.parametrize("kind", KINDS)
@given(seed=st.integers(0, 10**6), factor=st.floats(0.01, 100))
def test_rigid_motion_and_scale(kind, seed, factor):
    mesh = shapes.bumpy_sphere(2, rng=seed)
    moved = mesh.transformed(rotation(seed) * factor).translated([1, 2, 3])
    before, after = laplacian(mesh, kind), laplacian(moved, kind)
    # L is dimensionless in two dimensions, and M an area.
    np.testing.assert_allclose(after.stiffness.toarray(), before.stiffness.toarray(), atol=1e-8)
    np.testing.assert_allclose(after.mass.diagonal(), before.mass.diagonal() * factor**2, rtol=1e-8)


@given(seed=st.integers(0, 10**6))
def test_vertex_permutation(seed):
    mesh = shapes.bumpy_sphere(2, rng=3)
    order = np.random.default_rng(seed).permutation(mesh.n_vertices)
    renamed = Mesh(mesh.vertices[order], np.argsort(order)[mesh.faces])
    expected = laplacian(mesh).stiffness.toarray()[np.ix_(order, order)]
    np.testing.assert_allclose(laplacian(renamed).stiffness.toarray(), expected, atol=1e-12)


def test_cotan_is_exact_on_linear_functions_of_the_plane(irregular_square):
    mesh = irregular_square(200, 0)
    operator = laplacian(mesh)
    inner = (np.abs(mesh.vertices[:, :2] - 0.5) < 0.49).all(axis=1)
    assert inner.sum() == 200
    assert np.abs((operator.stiffness @ mesh.vertices[:, :2])[inner]).max() < 1e-11
    energy = mesh.vertices[:, 0] @ operator.stiffness @ mesh.vertices[:, 0]
    assert energy == pytest.approx(1, rel=1e-12)


def test_consistent_mass_integrates_products_of_linear_functions(irregular_square):
    mesh = irregular_square(100, 0)
    full, x, y = laplacian(mesh, mass="consistent").mass, mesh.vertices[:, 0], mesh.vertices[:, 1]
    assert x @ full @ y == pytest.approx(1 / 4, rel=1e-12)
    assert x @ full @ x == pytest.approx(1 / 3, rel=1e-12)
    np.testing.assert_allclose(full.sum(axis=1), laplacian(mesh).mass.diagonal(), rtol=1e-12)


def test_intrinsic_agrees_with_robust_on_a_delaunay_mesh():
    mesh = shapes.icosphere(2)
    plain, delaunay = laplacian(mesh), laplacian(mesh, "robust", mollify=0)
    assert abs(plain.stiffness - delaunay.stiffness).max() < 1e-9
    assert abs(plain.mass - delaunay.mass).max() < 1e-9


def mean_error(mesh: Mesh, kind: str) -> float:
    operator = laplacian(mesh, kind)
    f = mesh.vertices[:, 0] * mesh.vertices[:, 1]
    applied = (operator.stiffness @ f) / operator.mass.diagonal()
    return float(np.sqrt(np.mean((applied - 6 * f) ** 2)))


def test_mesh_laplacian_converges_point_by_point_where_cotan_does_not(irregular_sphere):
    meshes = [irregular_sphere(n, 5) for n in (500, 2000, 6000)]
    cotan = [mean_error(mesh, "cotan") for mesh in meshes]
    gaussian = [mean_error(mesh, "mesh") for mesh in meshes]
    assert min(cotan) > 0.5
    assert gaussian[1] < 0.65 * gaussian[0]
    assert gaussian[2] < 0.7 * gaussian[1]
    assert gaussian[2] < 0.15 * cotan[2]


@pytest.mark.parametrize("kind", ["robust", "mesh"])
def test_point_clouds(kind, irregular_sphere):
    points = irregular_sphere(1500, 2).vertices
    operator = laplacian(points, kind)
    assert operator.area == pytest.approx(4 * np.pi, rel=0.02)
    energy = points[:, 2] @ operator.stiffness @ points[:, 2]
    assert energy == pytest.approx(2 * 4 * np.pi / 3, rel=0.1)


def three_fins() -> Mesh:
    return Mesh([[0, 0, 0], [0, 0, 1], [1, 0, 0], [-1, 1, 0], [-1, -1, 0]], [[0, 1, 2], [0, 1, 3], [0, 1, 4]])


def test_cotan_refuses_non_manifold_edges_and_names_robust():
    with pytest.raises(MeshError, match=r"1 of 7 edges have three faces.*\[\[0, 1\]\].*kind='robust'"):
        laplacian(three_fins())
    assert laplacian(three_fins(), "robust").stiffness.shape == (5, 5)


@pytest.mark.parametrize("kind", KINDS)
def test_loose_vertices_are_refused(kind):
    mesh = shapes.icosphere(1)
    loose = Mesh(np.vstack([mesh.vertices, [[5, 5, 5]]]), mesh.faces)
    with pytest.raises(MeshError, match=r"1 of 43 vertices are in no face, first \[42\]"):
        laplacian(loose, kind)


def test_faces_without_area_are_counted():
    flat = Mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0]], [[0, 1, 2], [0, 3, 1]])
    with pytest.raises(MeshError, match=r"1 of 2 faces have no area, first \[1\].*robust"):
        laplacian(flat)
    point = Mesh(np.zeros((3, 3)), [[0, 1, 2]])
    for kind in KINDS:
        with pytest.raises(MeshError, match="no area"):
            laplacian(point, kind)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kind": "cotangent"}, "kind must be"),
        ({"mass": "voronoi"}, "mass must be"),
        ({"kind": "mesh", "mass": "consistent"}, "goes with kind='cotan' only"),
        ({"bandwidth": 1.0}, "goes with kind='mesh'"),
        ({"kind": "mesh", "bandwidth": -1.0}, "positive squared length"),
        ({"kind": "mesh", "bandwidth": np.nan}, "positive squared length"),
    ],
)
def test_options_out_of_range(options, message):
    with pytest.raises(InputError, match=message):
        laplacian(shapes.icosphere(1), **options)


def test_points_out_of_range():
    with pytest.raises(InputError, match="needs triangles"):
        laplacian(np.eye(5, 3))
    with pytest.raises(InputError, match="shape"):
        laplacian(np.zeros((3, 2)), "robust")
    with pytest.raises(InputError, match="1 of 5 points are NaN"):
        laplacian(np.vstack([np.eye(4, 3), [[np.nan, 0, 0]]]), "robust")
    with pytest.raises(InputError, match="neighbours must be"):
        laplacian(np.eye(5, 3), "robust")


def test_lengths_and_faces_must_fit():
    with pytest.raises(InputError, match="shape"):
        cotan_laplacian([[1, 1]], [[0, 1, 2]])
    with pytest.raises(InputError, match=r"0\.\.2"):
        cotan_laplacian([[1, 1, 1]], [[0, 1, 3]], n_vertices=3)
    with pytest.raises(MeshError, match="no area"):
        cotan_laplacian([[1, 1, 3]], [[0, 1, 2]])


def test_matrices_must_fit():
    with pytest.raises(InputError, match="one shape"):
        Laplacian(sp.eye_array(3), sp.eye_array(4))
    with pytest.raises(InputError, match="NaN or infinite"):
        Laplacian(sp.eye_array(3) * np.nan, sp.eye_array(3))


def test_caller_keeps_writable_matrices():
    stiffness = sp.csr_array(np.array([[1.0, -1.0], [-1.0, 1.0]]))
    Laplacian(stiffness, sp.eye_array(2, format="csr"))
    stiffness.data[0] = 2
    assert stiffness.data[0] == 2


def test_pieces_are_counted_through_zero_weights():
    # Every diagonal of a square grid has cotangent weight zero, and cuts nothing.
    assert laplacian(shapes.grid(4, 4)).components()[0] == 1
    sphere = shapes.icosphere(1)
    n = sphere.n_vertices
    two = Mesh(np.vstack([sphere.vertices, sphere.vertices + 5]), np.vstack([sphere.faces, sphere.faces + n]))
    count, labels = laplacian(two).components()
    assert count == 2
    assert (labels == np.repeat([0, 1], n)).all()
