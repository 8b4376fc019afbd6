"""Reading pictures: every kind that people have, and the kinds that must be refused."""

from __future__ import annotations

import io
import struct
import warnings
import zlib

import numpy as np
import pytest

from pliant.errors import InputError, PliantWarning
from pliant.images import as_picture, decode_picture, load_picture, match_pair
from pliant.images.padding import inside_of_padding

pytest.importorskip("cv2")
Image = pytest.importorskip("PIL.Image")


@pytest.fixture(scope="module")
def photo():
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:120, :160]
    grey = 128 + 60 * np.sin(x / 9) * np.cos(y / 7) + rng.normal(0, 5, (120, 160))
    return np.clip(np.stack([grey, grey * 0.8, grey * 0.6], axis=-1), 10, 245).astype(np.uint8)


def saved(tmp_path, array, name, **options):
    path = tmp_path / name
    Image.fromarray(array).save(path, **options)
    return path


def test_colour_grey_and_16_bits_agree(tmp_path, photo):
    grey = photo[..., 0]
    eight = load_picture(saved(tmp_path, grey, "grey.png"))
    wide = load_picture(saved(tmp_path, grey.astype(np.uint16) * 257, "wide.png"))
    colour = load_picture(saved(tmp_path, np.repeat(grey[..., None], 3, axis=2), "colour.png"))
    assert np.allclose(eight.grey, wide.grey, atol=1e-4)
    assert np.allclose(eight.grey, colour.grey, atol=1e-4)
    assert eight.size == (160, 120)
    assert not eight.grey.flags.writeable
    assert eight.colour.shape == (120, 160, 3)


def test_transparency_becomes_the_mask(tmp_path, photo):
    alpha = np.full((120, 160, 1), 255, np.uint8)
    alpha[:, :40] = 0
    picture = load_picture(saved(tmp_path, np.concatenate([photo, alpha], axis=2), "alpha.png"))
    assert not picture.mask[:, :40].any()
    assert picture.mask[:, 40:].all()
    assert "transparent" in picture.notes[0]


@pytest.mark.parametrize(("orientation", "turns"), [(3, 2), (6, 3), (8, 1)])
def test_exif_orientation_is_applied(tmp_path, photo, orientation, turns):
    exif = Image.Exif()
    exif[0x0112] = orientation
    stored = load_picture(saved(tmp_path, photo, "plain.png"))
    turned = load_picture(saved(tmp_path, photo, "turned.png", exif=exif))
    assert np.allclose(turned.grey, np.rot90(stored.grey, turns))
    assert turned.size == turned.grey.shape[::-1]
    assert "upright" in turned.notes[0]


def test_large_pictures_are_reduced_and_it_is_said(tmp_path):
    wide = np.zeros((300, 5000), np.uint8)
    wide[:, ::7] = 200
    with pytest.warns(PliantWarning, match="reduced"):
        picture = load_picture(saved(tmp_path, wide, "wide.png"))
    assert max(picture.grey.shape) <= 2048
    assert picture.size == (5000, 300)
    assert picture.reduction[0] == pytest.approx(2048 / 5000, rel=1e-2)


def test_boxes_of_a_reduced_picture_are_in_pixels_of_the_source(tmp_path):
    from scipy.ndimage import gaussian_filter

    scene = gaussian_filter(np.random.default_rng(2).random((300, 400)), 4)
    scene = np.rint(255 * (scene - scene.min()) / np.ptp(scene)).astype(np.uint8)
    large = np.kron(scene, np.ones((8, 8), np.uint8))
    with pytest.warns(PliantWarning, match="reduced"):
        match = match_pair(large, scene)
    assert np.allclose(match.transform[:2, :2], np.eye(2) / 8, atol=0.004)
    assert match.box1[2] > 2000


def test_a_hundred_megapixels_are_bounded(tmp_path):
    """A flat PNG of 10,000 x 10,000 is a small file; reading it must neither warn of a bomb nor keep its pixels."""
    path = tmp_path / "huge.png"
    path.write_bytes(flat_png(10_000, 10_000))
    with pytest.warns(PliantWarning, match="10000 x 10000 pixels reduced"):
        picture = load_picture(path)
    assert max(picture.grey.shape) <= 2048


@pytest.mark.parametrize("side", [14_000, 30_000])
def test_a_decompression_bomb_is_refused_before_it_is_decoded(tmp_path, side):
    path = tmp_path / "bomb.png"
    path.write_bytes(flat_png(side, side, rows=1))
    with pytest.raises(InputError, match="more than 178,956,970 pixels"):
        load_picture(path)


def flat_png(width, height, rows=None):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    line = b"\0" + bytes(width)
    pack = zlib.compressobj(1)
    body = b"".join(pack.compress(line) for _ in range(rows or height)) + pack.flush()
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")


def test_a_truncated_jpeg_is_refused(tmp_path, photo):
    buffer = io.BytesIO()
    Image.fromarray(photo).save(buffer, "JPEG")
    path = tmp_path / "cut.jpg"
    path.write_bytes(buffer.getvalue()[: len(buffer.getvalue()) // 2])
    with pytest.raises(InputError, match="truncated or damaged"):
        load_picture(path)


def test_what_is_not_a_picture_is_refused(tmp_path):
    path = tmp_path / "words.jpg"
    path.write_text("not a picture")
    with pytest.raises(InputError, match="not a picture"):
        load_picture(path)
    with pytest.raises(InputError, match="No such file"):
        load_picture(tmp_path / "missing.png")


@pytest.mark.parametrize(
    ("array", "words"),
    [
        (np.zeros((4, 4, 5)), "an image is an array"),
        (np.zeros((0, 4)), "an image is an array"),
        (np.full((4, 4), 2.0), "in 0..1"),
        (np.full((4, 4), np.nan), "not finite"),
        (np.full((4, 4), -1), "0..65535"),
        (np.full((4, 4), "a"), "numbers"),
    ],
)
def test_bad_arrays_are_refused(array, words):
    with pytest.raises(InputError, match=words):
        as_picture(array)


def test_masks_must_fit(photo):
    with pytest.raises(InputError, match="the mask has shape"):
        as_picture(photo, mask=np.ones((5, 5)))
    masked = as_picture(as_picture(photo), mask=np.zeros((120, 160)))
    assert not masked.mask.any()


@pytest.mark.parametrize("value", [0.0, 1.0])
@pytest.mark.parametrize("angle", [0, 10])
def test_fill_around_a_picture_is_found(value, angle):
    y, x = np.mgrid[:150, :200]
    turn = np.deg2rad(angle)
    u = np.cos(turn) * (x - 100) + np.sin(turn) * (y - 75)
    v = -np.sin(turn) * (x - 100) + np.cos(turn) * (y - 75)
    frame = (np.abs(u) < 70) & (np.abs(v) < 50)
    grey = np.where(frame, 0.5 + 0.2 * np.sin(x / 5), value)
    inside = inside_of_padding(grey)
    assert not (inside & ~frame).any()
    assert inside.sum() > 0.9 * frame.sum()


def test_paper_and_night_sky_are_not_fill():
    y, x = np.mgrid[:150, :200]
    drawing = np.ones((150, 200))
    drawing[40:120:8, 60:140] = 0.2
    drawing[40:120, 60:140:16] = 0.2
    drawing[20:40, 98:102] = 0.3
    assert inside_of_padding(drawing).all()
    skyline = 60 + 25 * np.sign(np.sin(x / 12))
    night = np.where(y < skyline, 0.0, 0.4 + 0.1 * np.sin(x * y / 50))
    assert inside_of_padding(night).all()


def test_a_picture_read_twice_is_the_same_and_reading_is_silent(tmp_path, photo):
    path = saved(tmp_path, photo, "photo.jpg")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        one, two = load_picture(path), load_picture(path)
    assert np.array_equal(one.grey, two.grey)
    assert one.mask.all()


def test_bytes_of_a_file_give_the_same_picture_as_the_file(tmp_path):
    pixels = np.random.default_rng(0).integers(0, 256, (30, 40, 3), dtype=np.uint8)
    path = tmp_path / "noise.png"
    Image.fromarray(pixels).save(path)
    from_file, from_bytes = load_picture(path), decode_picture(path.read_bytes())
    assert np.array_equal(from_file.grey, from_bytes.grey)
    assert np.array_equal(from_file.colour, pixels)


def test_bytes_of_unknown_origin_are_read_by_harmless_readers_only(tmp_path):
    Image.new("RGB", (20, 20), "red").save(tmp_path / "red.eps")
    with pytest.raises(InputError, match=r"the upload is not a picture of a known format \(JPEG, PNG"):
        decode_picture((tmp_path / "red.eps").read_bytes(), name="the upload")


def test_bytes_with_more_pixels_than_allowed_are_refused_and_reduced_ones_said_without_a_warning(tmp_path):
    Image.new("L", (4500, 20), 128).save(tmp_path / "long.png")
    data = (tmp_path / "long.png").read_bytes()
    with pytest.raises(InputError, match="4500 x 20 are more than 89,999 pixels"):
        decode_picture(data, max_pixels=89_999)
    assert any("reduced" in note for note in decode_picture(data).notes)
    with pytest.warns(PliantWarning, match="reduced"):
        load_picture(tmp_path / "long.png")
