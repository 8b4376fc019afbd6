"""Per-vertex arrays in and out."""

from __future__ import annotations

import io
import random
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from mesh_file_samples import FACES, SAMPLES, VERTICES

from pliant.errors import FileFormatError, InputError, PliantError, PliantWarning
from pliant.mesh import Mesh, load_arrays, load_mesh, load_parcellation, save_arrays, save_mesh
from pliant.mesh.arrays import holds_arrays_only

MESH = Mesh(VERTICES, FACES)
PLAIN = {
    "gfe": np.linspace(0, 1, 6) / 3,
    "labels": np.arange(6, dtype=np.int32) - 3,
    "mask": np.array([1, 0, 1, 0, 1, 1], dtype=np.uint8),
    "missing": np.array([1.5, np.nan, np.inf, -np.inf, 0.0, -0.0]),
}


@pytest.mark.parametrize(
    "ending", [".npz", ".ply", ".vtk", ".vtp", ".vtu", ".vtp.gz", ".func.gii", ".shape.gii"]
)
def test_arrays_come_back_with_name_type_and_value(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"x{ending}"
    arrays = {**PLAIN, "vectors": VERTICES} if ending != ".ply" else PLAIN
    save_arrays(path, arrays, mesh=None if ending == ".npz" else MESH)
    back = load_arrays(path)
    assert list(back) == list(arrays)
    for name, values in arrays.items():
        # The GIFTI standard knows no float64.
        expected = values.astype(np.float32) if ending.endswith(".gii") and values.dtype == float else values
        assert back[name].dtype == expected.dtype, name
        np.testing.assert_array_equal(back[name], expected)


@pytest.mark.parametrize("ending", [".ply", ".vtk", ".vtp", ".vtu"])
def test_arrays_ride_on_the_mesh(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"x{ending}"
    save_mesh(path, MESH, data=PLAIN)
    mesh = load_mesh(path)
    np.testing.assert_array_equal(mesh.vertices, VERTICES)
    np.testing.assert_array_equal(mesh.faces, FACES)
    np.testing.assert_array_equal(load_arrays(path)["missing"], PLAIN["missing"])


def test_npz_keeps_the_mesh_and_settings_of_any_shape(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    save_arrays(
        path,
        {"gfe": PLAIN["gfe"], "settings": np.array('{"graph": "edges"}'), "grid": np.ones((2, 3, 4))},
        mesh=MESH,
    )
    back = load_arrays(path)
    assert str(back["settings"]) == '{"graph": "edges"}'
    assert back["grid"].shape == (2, 3, 4)
    np.testing.assert_array_equal(back["vertices"], VERTICES)
    with np.load(path, allow_pickle=False) as other:
        np.testing.assert_array_equal(other["faces"], FACES)
        np.testing.assert_array_equal(other["gfe"], PLAIN["gfe"])
    with pytest.raises(InputError, match="the names of the mesh's own arrays"):
        save_arrays(path, {"faces": [1]}, mesh=MESH)


def test_ply_spreads_columns_and_narrows_whole_numbers(tmp_path: Path) -> None:
    path = tmp_path / "x.ply"
    save_arrays(path, {"v": VERTICES, "n": np.arange(6), "b": np.arange(6) > 2}, mesh=MESH)
    back = load_arrays(path)
    assert list(back) == ["v_0", "v_1", "v_2", "n", "b"]
    np.testing.assert_array_equal(back["v_2"], VERTICES[:, 2])
    assert (back["n"].dtype, back["b"].dtype) == (np.int32, np.uint8)
    with pytest.raises(InputError, match="beyond 32 bits"):
        save_arrays(path, {"n": np.arange(6) << 40}, mesh=MESH)


def test_gifti_is_read_by_nibabel(tmp_path: Path) -> None:
    import nibabel

    path = tmp_path / "x.func.gii"
    save_arrays(path, {"a <b>": PLAIN["gfe"], "labels": PLAIN["labels"]})
    image = nibabel.load(path)
    assert [array.meta["Name"] for array in image.darrays] == ["a <b>", "labels"]
    np.testing.assert_array_equal(image.darrays[0].data, PLAIN["gfe"].astype(np.float32))
    assert list(load_arrays(path)) == ["a <b>", "labels"]


def test_arrays_of_gifti_without_a_name_are_numbered(tmp_path: Path) -> None:
    import nibabel

    arrays = [nibabel.gifti.GiftiDataArray(np.full(3, k, dtype=np.float32)) for k in range(2)]
    nibabel.save(nibabel.gifti.GiftiImage(darrays=arrays), tmp_path / "x.func.gii")
    back = load_arrays(tmp_path / "x.func.gii")
    assert {name: values.tolist() for name, values in back.items()} == {
        "array_0": [0] * 3,
        "array_1": [1] * 3,
    }


@given(
    name=st.text(st.characters(blacklist_categories=("Cs", "Cc")), min_size=1).filter(
        lambda s: s.strip() == s
    ),
    values=hnp.arrays(np.float64, 6, elements=st.floats(allow_nan=False)),
)
def test_vtp_keeps_any_name_and_value(tmp_path_factory, name: str, values: np.ndarray) -> None:
    path = tmp_path_factory.getbasetemp() / "any.vtp"
    save_arrays(path, {name: values}, mesh=MESH)
    ((back, kept),) = load_arrays(path).items()
    assert back == name
    np.testing.assert_array_equal(kept, values)


@pytest.mark.parametrize(
    ("name", "arrays", "message"),
    [
        ("x.ply", {"a": [1.0, 2.0]}, "one row a vertex, 6 of them, got 2"),
        ("x.vtp", {"a": np.ones((6, 2, 2))}, r"shape \(n,\) or \(n, k\)"),
        ("x.vtp", {"a": ["b"] * 6}, "real numbers"),
        ("x.ply", {"a b": np.ones(6)}, "cannot be PLY properties"),
        ("x.ply", {"x": np.ones(6)}, "cannot be PLY properties"),
        ("x.ply", {"a": np.ones((6, 2)), "a_1": np.ones(6)}, "cannot be PLY properties"),
        ("x.vtk", {"a b": np.ones(6)}, "cannot name a VTK array"),
        ("x.off", {"a": np.ones(6)}, "OFF holds no per-vertex arrays"),
        ("x.npz", {"a": [object()]}, "Python objects"),
        ("x.func.gii", {"a": np.full(6, 2**40)}, "beyond 32 bits"),
    ],
)
def test_what_cannot_be_written_is_said(name: str, arrays: dict, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=message):
        save_arrays(tmp_path / name, arrays, mesh=MESH if name != "x.npz" else None)
    assert list(tmp_path.iterdir()) == []


def test_formats_on_a_mesh_need_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="pass mesh="):
        save_arrays(tmp_path / "x.vtp", {"a": np.ones(6)})
    with pytest.raises(InputError, match="save_arrays beside the mesh"):
        save_mesh(tmp_path / "x.surf.gii", MESH, data=PLAIN)
    with pytest.raises(InputError, match="one row a vertex"):
        save_arrays(tmp_path / "x.func.gii", {"a": np.ones(6), "b": np.ones(5)})


def _npz(entry: bytes) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("a.npy", entry)
    return stream.getvalue()


def test_npz_claims_and_pickles_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (400000000,), }".ljust(117) + b"\n"
    path.write_bytes(_npz(b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + bytes(80)))
    with pytest.raises(FileFormatError, match="claims 3200000000 bytes"):
        load_arrays(path)
    np.savez(path, a=np.array([{"x": 1}], dtype=object))
    with pytest.raises(FileFormatError, match="pickled objects, which are not read"):
        load_arrays(path)
    path.write_bytes(b"not a zip")
    with pytest.raises(FileFormatError, match="not a readable NPZ file"):
        load_arrays(path)
    with pytest.raises(FileFormatError, match="no such file"):
        load_arrays(tmp_path / "none.npz")


def test_npz_in_column_order_and_scalars(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    np.savez_compressed(path, a=np.asfortranarray(np.arange(6).reshape(2, 3)), b=np.float64(3))
    back = load_arrays(path)
    assert back["a"].tolist() == [[0, 1, 2], [3, 4, 5]]
    assert back["b"] == 3
    back["a"][0, 0] = 7  # the caller's own


def test_mutated_npz_ends_in_arrays_or_a_named_error(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    save_arrays(path, PLAIN, mesh=MESH)
    whole, chance = path.read_bytes(), random.Random(5)
    errors = 0
    for _ in range(300):
        data = bytearray(whole)
        for _ in range(chance.randint(1, 4)):
            data[chance.randrange(len(data))] = chance.randrange(256)
        path.write_bytes(bytes(data[: chance.choice([len(data), chance.randrange(1, len(data))])]))
        try:
            load_arrays(path)
        except PliantError:
            errors += 1
    assert errors > 100


def test_a_mesh_without_arrays_has_none(tmp_path: Path) -> None:
    path = tmp_path / "x.off"
    path.write_bytes(SAMPLES["text.off"])
    assert load_arrays(path) == {}


@pytest.mark.data
def test_real_gifti_data_against_nibabel(data: Path) -> None:
    import nibabel

    path = data / "cortex" / "slam" / "example_dpf.gii"
    (values,) = load_arrays(path).values()
    np.testing.assert_array_equal(values, nibabel.load(path).agg_data())


def test_npy_is_called_like_its_file(tmp_path: Path) -> None:
    np.save(tmp_path / "heat.npy", PLAIN["missing"])
    back = load_arrays(tmp_path / "heat.npy")
    assert list(back) == ["heat"]
    np.testing.assert_array_equal(back["heat"], PLAIN["missing"])


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        (lambda data: data[:-3], "claims 48 bytes and has 45"),
        (lambda data: data.replace(b"(6,)", b"(6000000000000,)".ljust(4)), "NPY|claims"),
        (lambda data: b"", "empty|NPY"),
        (lambda data: b"no numbers", "NPY"),
    ],
)
def test_a_broken_npy_is_refused(broken, words, tmp_path: Path) -> None:
    stream = io.BytesIO()
    np.save(stream, PLAIN["missing"])
    (tmp_path / "x.npy").write_bytes(broken(stream.getvalue()))
    with pytest.raises(FileFormatError, match=words):
        load_arrays(tmp_path / "x.npy")


def test_an_npy_of_objects_is_not_unpickled(tmp_path: Path) -> None:
    np.save(tmp_path / "x.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    with pytest.raises(FileFormatError, match="pickled objects"):
        load_arrays(tmp_path / "x.npy")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1\n2\n3\n", {"x": [1, 2, 3]}),
        ("thickness,part\n0.5,1\n,2\n2e-1,1\n", {"thickness": [0.5, np.nan, 0.2], "part": [1, 2, 1]}),
        ("# made by hand\n1;2\n3;4\n", {"column 1": [1, 3], "column 2": [2, 4]}),
        ("\ufeffa\tb\n1\t-1\n", {"a": [1], "b": [-1]}),
        ("1 2.5\n3 nan\n", {"column 1": [1, 3], "column 2": [2.5, np.nan]}),
    ],
)
def test_tables(text: str, expected: dict[str, list[float]], tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text(text, encoding="utf-8")
    back = load_arrays(tmp_path / "x.csv")
    assert list(back) == list(expected)
    for name, values in expected.items():
        np.testing.assert_array_equal(back[name], values)
        assert back[name].dtype == np.asarray(values).dtype


def test_a_column_of_words_is_left_out_and_said(tmp_path: Path) -> None:
    (tmp_path / "x.csv").write_text("name,value\nleft,1\nright,2\n")
    with pytest.warns(PliantWarning, match="do not hold numbers: name"):
        assert list(load_arrays(tmp_path / "x.csv")) == ["value"]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,2\n3\n", "1 rows do not have the 2 cells .* row 2 with 1"),
        ("\n", "empty"),
        ("a,b\nc,d\n", "no column"),
        ("a\n1_0\n2\n", "no column"),
        ("a,a\n1,2\n", "1 columns have the name of another"),
    ],
)
def test_a_table_without_numbers_or_rows_of_one_length_is_refused(
    text: str, words: str, tmp_path: Path
) -> None:
    (tmp_path / "x.csv").write_text(text)
    with pytest.raises(FileFormatError, match=words):
        load_arrays(tmp_path / "x.csv")


def test_freesurfer_morphometry_and_annotations(tmp_path: Path) -> None:
    from nibabel.freesurfer import write_annot, write_morph_data

    write_morph_data(tmp_path / "lh.thickness", np.array([1.5, 2.5, 0.0]))
    assert load_arrays(tmp_path / "lh.thickness")["lh.thickness"].tolist() == [1.5, 2.5, 0.0]
    whole = (tmp_path / "lh.thickness").read_bytes()
    (tmp_path / "lh.thickness").write_bytes(whole[:-1])
    with pytest.raises(FileFormatError):
        load_arrays(tmp_path / "lh.thickness")
    colours = np.array([[9, 0, 0, 0, 0], [0, 9, 0, 0, 0]])
    write_annot(tmp_path / "lh.x.annot", np.array([1, 0, -1]), colours, ["a", "b"], fill_ctab=True)
    assert load_arrays(tmp_path / "lh.x.annot")["lh.x.annot"].tolist() == [1, 0, -1]
    assert load_parcellation(tmp_path / "lh.x.annot").names == {0: "a", 1: "b"}
    annot = (tmp_path / "lh.x.annot").read_bytes()
    for stop in range(0, len(annot), 7):
        (tmp_path / "cut.annot").write_bytes(annot[:stop])
        with pytest.raises(FileFormatError):
            load_parcellation(tmp_path / "cut.annot")


def test_meshes_are_told_from_arrays(tmp_path: Path) -> None:
    save_mesh(tmp_path / "m.gii", MESH)
    save_arrays(tmp_path / "a.shape.gii", {"a": np.arange(6.0)})
    (tmp_path / "texture.gii").write_bytes((tmp_path / "a.shape.gii").read_bytes())
    save_mesh(tmp_path / "m.vtk", MESH, data=PLAIN)
    told = {name: holds_arrays_only(tmp_path / name) for name in ("m.gii", "texture.gii", "m.vtk", "no.gii")}
    assert told == {"m.gii": False, "texture.gii": True, "m.vtk": False, "no.gii": False}


@pytest.mark.data
def test_real_morphometry_against_nibabel(data: Path) -> None:
    from nibabel.freesurfer import read_morph_data

    path = data / "cortex" / "subject1" / "lh.thickness"
    np.testing.assert_array_equal(load_arrays(path)["lh.thickness"], read_morph_data(path))
