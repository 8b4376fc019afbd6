"""The software renderer against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from pliant import Mesh, shapes
from pliant.errors import InputError
from pliant.report.render import Raster, camera, interpolate, paint, rasterise

DIRECTIONS = ("left", "right", "front", "back", "top", "bottom")


def square(z: float = 0.0, side: float = 1.0) -> Mesh:
    corners = [[0, 0, z], [side, 0, z], [side, side, z], [0, side, z]]
    return Mesh(corners, [[0, 1, 2], [0, 2, 3]])


def joined(*meshes: Mesh) -> Mesh:
    starts = np.cumsum([0, *(mesh.n_vertices for mesh in meshes)])
    faces = np.vstack([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)])
    return Mesh(np.vstack([mesh.vertices for mesh in meshes]), faces)


def centre_pixel(raster: Raster) -> tuple[int, int]:
    return raster.face.shape[0] // 2, raster.face.shape[1] // 2


@pytest.mark.parametrize("up", ["y", "z"])
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_cameras_are_rotations(direction, up):
    rotation = camera(direction, up=up)
    assert np.allclose(rotation @ rotation.T, np.eye(3))
    assert np.linalg.det(rotation) == pytest.approx(1)


def test_y_up_cameras_keep_the_top_up_and_the_face_to_the_viewer():
    assert np.allclose(camera("front", up="y"), np.eye(3))
    assert np.allclose(camera("top", up="y")[2], [0, 1, 0])
    assert np.allclose(camera("left", up="y")[2], [1, 0, 0])  # the shape's own left


@pytest.mark.parametrize("direction", DIRECTIONS)
def test_silhouette_of_a_sphere_is_a_disc(direction):
    sphere = shapes.icosphere(5)
    raster = rasterise(sphere, camera(direction), pixel=0.01)
    assert raster.coverage.sum() * raster.pixel**2 == pytest.approx(np.pi, rel=2e-3)


def test_silhouette_area_scales_with_the_square_of_the_pixel():
    sphere = shapes.icosphere(4)
    areas = [rasterise(sphere, camera("top"), pixel=pixel).coverage.sum() for pixel in (0.02, 0.01)]
    assert areas[1] / areas[0] == pytest.approx(4, rel=1e-3)


def test_depth_of_a_sphere_is_its_height():
    raster = rasterise(shapes.icosphere(5), camera("front"), pixel=0.01)
    rows, columns = np.indices(raster.face.shape)
    step = raster.pixel / raster.samples
    x = (columns + 0.5 - raster.face.shape[1] / 2) * step
    y = (rows + 0.5 - raster.face.shape[0] / 2) * step
    inside = x**2 + y**2 < 0.9
    assert np.allclose(raster.depth[inside], np.sqrt(1 - (x**2 + y**2)[inside]), atol=5e-3)


@pytest.mark.parametrize("order", [(0.0, 1.0), (1.0, 0.0)])
def test_the_nearer_of_two_sheets_is_seen_whatever_their_order(order):
    sheets = joined(square(order[0]), square(order[1]))
    near = 0 if order[0] > order[1] else 1
    from_above = rasterise(sheets, camera("top"), pixel=0.05)
    from_below = rasterise(sheets, camera("bottom"), pixel=0.05)
    assert set(np.unique(from_above.face[from_above.face >= 0]) // 2) == {near}
    assert set(np.unique(from_below.face[from_below.face >= 0]) // 2) == {1 - near}


def test_linear_values_are_carried_exactly():
    patch = shapes.grid(7, 5)
    field = patch.vertices @ [2.0, -3.0, 0.0] + 0.5
    raster = rasterise(patch, camera("top"), pixel=0.01)
    seen = interpolate(raster, patch, field)
    spots = np.einsum("hwc,hwcd->hwd", raster.weights, patch.vertices[patch.faces[raster.face]])
    visible = raster.face >= 0
    assert np.allclose(seen[visible], (spots @ [2.0, -3.0, 0.0] + 0.5)[visible], atol=1e-5)
    assert np.isnan(seen[~visible]).all()


def test_a_missing_vertex_value_stays_missing_around_it():
    mesh = square()
    raster = rasterise(mesh, camera("top"), pixel=0.05)
    seen = interpolate(raster, mesh, [0.0, np.nan, 2.0, 3.0])
    assert np.isnan(seen[raster.face == 0]).all()
    assert np.isfinite(seen[raster.face == 1]).all()


def test_image_axes_point_right_and_up():
    mesh = square()
    raster = rasterise(mesh, camera("top"), pixel=0.1)
    x, y = (interpolate(raster, mesh, mesh.vertices[:, axis]) for axis in (0, 1))
    row, column = centre_pixel(raster)
    assert x[row, column + 4] > x[row, column]
    assert y[row - 4, column] > y[row, column]


def test_both_sides_of_a_sheet_are_lit_alike():
    mesh = square()
    front, flipped = (rasterise(m, camera("top"), pixel=0.1) for m in (mesh, mesh.flipped()))
    assert np.allclose(front.shade, flipped.shade)
    assert front.shade.max() > 0.8


def test_light_falls_off_towards_the_rim_and_comes_from_above_left():
    raster = rasterise(shapes.icosphere(4), camera("front"), pixel=0.02)
    row, column = centre_pixel(raster)
    quarter = raster.face.shape[0] // 4
    assert raster.shade[row, column] > raster.shade[row, 14]
    assert raster.shade[row - quarter, column - quarter] > raster.shade[row + quarter, column + quarter]


def test_unlit_paint_is_the_colour_asked_for_on_a_transparent_ground():
    raster = rasterise(square(), camera("top"), pixel=0.1)
    image = paint(raster, np.full((*raster.face.shape, 3), (1.0, 0.5, 0.0), dtype=np.float32), lit=False)
    row, column = image.shape[0] // 2, image.shape[1] // 2
    assert image[row, column].tolist() == [255, 128, 0, 255]
    assert image[0, 0, 3] == 0


def test_edges_are_smoothed():
    raster = rasterise(shapes.icosphere(3), camera("top"), pixel=0.05)
    assert np.any((raster.coverage > 0) & (raster.coverage < 1))


@pytest.mark.parametrize("options", [{"pixel": 0}, {"pixel": np.nan}, {"pixel": 0.1, "samples": 0}])
def test_impossible_sizes_are_refused(options):
    with pytest.raises(InputError, match="positive"):
        rasterise(square(), camera("top"), **options)


def test_an_image_past_memory_is_refused():
    with pytest.raises(InputError, match="too large"):
        rasterise(square(), camera("top"), pixel=1e-6)


def test_unknown_names_are_refused():
    with pytest.raises(InputError, match="left, right"):
        camera("sideways")
    with pytest.raises(InputError, match="'y' or 'z'"):
        camera("left", up="x")
    with pytest.raises(InputError, match="one value a vertex"):
        interpolate(rasterise(square(), camera("top"), pixel=0.1), square(), [1.0])
