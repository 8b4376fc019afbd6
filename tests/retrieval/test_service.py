"""The search service over HTTP: what it answers, what it refuses, and that nothing it is sent makes it fail."""

from __future__ import annotations

import base64
import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiny_encoder import Image, TinyEncoder, encoded, scene, write_classes

from pliant.errors import InputError
from pliant.images import as_picture
from pliant.retrieval import ServiceLimits, ShapeIndex, add_folder, create_app
from pliant.retrieval.querying import preview_jpeg

pytest.importorskip("faiss")
pytest.importorskip("fastapi")
testclient = pytest.importorskip("starlette.testclient")

HOME = "http://127.0.0.1:8000"
TOKEN = "correct-horse-battery"


@pytest.fixture(scope="module")
def index(tmp_path_factory):
    index = ShapeIndex(model=TinyEncoder())
    add_folder(index, write_classes(tmp_path_factory.mktemp("served"), {"<hills>": 5, "lakes": 7}))
    return index


@pytest.fixture(scope="module")
def client(index):
    with opened(create_app(index)) as client:
        yield client


def opened(app, home: str = HOME, **options):
    return testclient.TestClient(app, base_url=home, **options)


def ask(client, data: bytes, path: str = "/api/query", **fields):
    return client.post(path, files={"image": ("../../etc/passwd", data)}, data=fields)


def test_a_query_gives_the_nearest_pictures_and_how_it_was_understood(client):
    answer = ask(client, encoded(scene(3), "JPEG"), count=4)
    assert answer.status_code == 200
    reply = answer.json()
    assert reply["matches"][0]["name"] == "<hills>/3.jpg"
    distances = [match["distance"] for match in reply["matches"]]
    assert distances == sorted(distances)
    assert len(distances) == 4
    assert (reply["bits"], reply["width"], reply["height"]) == (64, 96, 72)
    shown = base64.b64decode(reply["preview"].removeprefix("data:image/jpeg;base64,"))
    assert Image.open(io.BytesIO(shown)).size == (96, 72)


def test_a_query_can_be_kept_to_one_class(client):
    reply = ask(client, encoded(scene(3)), count=50, label="lakes").json()
    assert len(reply["matches"]) == 7
    assert {match["label"] for match in reply["matches"]} == {"lakes"}
    answer = ask(client, encoded(scene(3)), label="emus")
    assert answer.status_code == 422
    assert "no item has the label 'emus'" in answer.json()["error"]


def test_shared_features_join_the_same_places(client):
    """The query is the right part of an indexed picture; half of its width is cut away."""
    whole = scene(8, 320, 240)
    index = ShapeIndex(model=TinyEncoder())
    index.add(index.model.encode([whole]), previews=[preview_jpeg(as_picture(whole))])
    with opened(create_app(index)) as other:
        reply = ask(other, encoded(whole[:, 80:]), "/api/shared", item=1).json()
    points = np.array(reply["points"])
    assert len(points) > 50
    assert reply["score"] > 0.5 * len(points)
    assert np.median(np.abs(80 + 240 * points[:, 0] - 320 * points[:, 2])) < 3
    assert np.median(np.abs(points[:, 1] - points[:, 3])) < 0.02
    x0, _, x1, _ = reply["item_box"]
    assert x0 == pytest.approx(0.25, abs=0.06)
    assert x1 > 0.9
    assert reply["reason"] == ""


def test_shared_features_of_a_plain_picture_are_none_with_the_reason(client):
    reply = ask(client, encoded(np.full((60, 60), 200, np.uint8)), "/api/shared", item=1)
    assert reply.status_code == 200
    assert reply.json()["points"] == []
    assert reply.json()["query_box"] is None
    assert "one colour" in reply.json()["reason"]


def test_the_index_is_described_sampled_and_shown(client):
    about = client.get("/api/index").json()
    assert about["items"] == 12
    assert about["labels"] == [{"label": "<hills>", "items": 5}, {"label": "lakes", "items": 7}]
    assert len(client.get("/api/sample", params={"count": 5}).json()) == 5
    answer = client.get("/api/items/1/preview")
    assert answer.headers["content-type"] == "image/jpeg"
    assert "immutable" in answer.headers["cache-control"]
    assert Image.open(io.BytesIO(answer.content)).size == (96, 72)
    assert client.get("/api/items/99/preview").status_code == 404


def bomb() -> bytes:
    """A PNG that promises 50,000 by 50,000 pixels in a few bytes."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", 50_000, 50_000, 8, 0, 0, 0, 0)
    rows = zlib.compress(bytes(100_000))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


JPEG = encoded(scene(1), "JPEG")
REFUSED = {
    "empty": (b"", "not a picture"),
    "text": (b"hello", "not a picture of a known format"),
    "cut": (JPEG[: len(JPEG) // 2], "truncated or damaged"),
    "header alone": (JPEG[:20], "picture"),
    "bomb": (bomb(), "pixels; reduce the picture first"),
    "one pixel": (encoded(np.zeros((1, 1), np.uint8)), "one colour"),
    "one colour": (encoded(np.full((50, 50, 3), 90, np.uint8)), "one colour"),
    "PostScript": (encoded(np.zeros((9, 9, 3), np.uint8), "EPS"), "not a picture of a known format"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_bad_pictures_are_refused_with_the_reason(client, kind):
    data, why = REFUSED[kind]
    answer = ask(client, data)
    assert answer.status_code == 422
    assert why in answer.json()["error"]
    shared = ask(client, data, "/api/shared", item=1)
    assert shared.status_code == (200 if why == "one colour" else 422)


ACCEPTED = {
    "16 bits": encoded(scene(2).astype(np.uint16) * 257),
    "transparency": encoded(np.dstack([scene(2)] * 3 + [np.full((72, 96), 255, np.uint8)])),
    "palette": encoded(scene(2), "GIF"),
    "turned": encoded(np.rot90(scene(2)).copy(), "JPEG", exif=b"Exif\x00\x00MM\x00*\x00\x00\x00\x08\x00\x01"
                      b"\x01\x12\x00\x03\x00\x00\x00\x01\x00\x06\x00\x00\x00\x00\x00\x00"),
    "long": encoded(np.kron(scene(2), np.ones((24, 24), np.uint8))),
}  # fmt: skip


@pytest.mark.parametrize("kind", ACCEPTED)
def test_odd_but_sound_pictures_find_themselves(client, kind):
    reply = ask(client, ACCEPTED[kind], count=1)
    assert reply.status_code == 200
    assert reply.json()["matches"][0]["name"] == "<hills>/2.jpg"
    if kind == "long":
        assert reply.json()["width"] == 96 * 24
        assert any("reduced" in note for note in reply.json()["notes"])
    if kind == "turned":
        assert any("upright" in note for note in reply.json()["notes"])


def test_an_empty_index_says_so(client):
    with opened(create_app(ShapeIndex(model=TinyEncoder()))) as empty:
        answer = ask(empty, JPEG)
        assert answer.status_code == 409
        assert "the index is empty" in answer.json()["error"]
        assert empty.get("/api/sample").json() == []
        assert empty.get("/api/index").json()["labels"] == []


def test_what_is_added_elsewhere_is_found(tmp_path):
    ShapeIndex(model=TinyEncoder()).save(tmp_path / "index")
    served = ShapeIndex.load(tmp_path / "index", model=TinyEncoder())
    with opened(create_app(served)) as client, ShapeIndex.load(tmp_path / "index") as writer:
        assert ask(client, JPEG).status_code == 409
        writer.add(TinyEncoder().encode([scene(1)]), names=["new"])
        assert ask(client, JPEG).json()["matches"][0]["name"] == "new"
        writer.remove([1])
        assert client.get("/api/index").json()["items"] == 0
    served.close()


@pytest.mark.parametrize("fields", [{"count": 0}, {"count": 97}, {"count": "many"}, {"label": "x" * 1001}])
def test_arguments_out_of_range_are_refused_by_name(client, fields):
    answer = ask(client, JPEG, **fields)
    assert answer.status_code == 422
    assert answer.json()["error"].startswith(next(iter(fields)))


def test_uploads_beyond_the_limits_are_refused(index):
    limits = ServiceLimits(upload_bytes=3000, pixels=96 * 72 - 1)
    with opened(create_app(index, limits=limits)) as client:
        assert ask(client, encoded(scene(1, 20, 20))).status_code == 200
        assert "6,911 pixels" in ask(client, JPEG[:2900]).json()["error"]
        for content in (
            bytes(4000),
            (bytes(500) for _ in range(8)),
        ):  # With a length, and in pieces without one.
            answer = client.post(
                "/api/query", content=content, headers={"Content-Type": "multipart/form-data; boundary=x"}
            )
            assert answer.status_code == 413
            assert "larger than 0.003 MB" in answer.json()["error"]
            assert answer.headers["content-security-policy"]


def test_the_token_is_asked_for_below_api_and_only_there(index):
    with opened(create_app(index, token=TOKEN, host="192.0.2.7"), "http://pictures.example") as client:
        for headers in (
            {},
            {"Authorization": f"Bearer {TOKEN}x"},
            {"Authorization": TOKEN},
            {"Authorization": b"\xff"},
        ):
            for path in ("/api/index", "/api/items/1/preview", "/api/nothing"):
                answer = client.get(path, headers=headers)
                assert answer.status_code == 401
                assert answer.headers["www-authenticate"] == "Bearer"
            assert client.post("/api/query", headers=headers).status_code == 401
        assert client.get("/").status_code == 200
        with_token = {"Authorization": f"Bearer {TOKEN}"}
        assert client.get("/api/index", headers=with_token).status_code == 200
        assert TOKEN not in client.get("/openapi.json").text


@pytest.mark.parametrize("token", [None, "", "short", "fifteen-chars-x"])
@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.0.2.7", "pictures.example"])
def test_beyond_loopback_a_token_of_some_length_is_required(index, host, token):
    with pytest.raises(InputError, match="give a token of 16 or more characters"):
        create_app(index, host=host, token=token)


def test_a_token_that_no_header_can_carry_is_refused(index):
    with pytest.raises(InputError, match="printable ASCII"):
        create_app(index, token="with a space")


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "", "localhost.evil.example:80"])
def test_only_this_machines_names_are_answered_on_loopback(client, host):
    answer = client.get("/api/index", headers={"Host": host})
    assert answer.status_code == 403
    for own in ("localhost", "localhost:8000", "127.0.0.1:9", "[::1]:8000", "[::1]"):
        assert client.get("/api/index", headers={"Host": own}).status_code == 200


def test_pages_of_other_sites_are_not_served(client):
    for origin, status in (
        ("https://evil.example", 403),
        ("null", 403),
        (HOME, 200),
        ("https://127.0.0.1", 403),
    ):
        assert client.get("/api/index", headers={"Origin": origin}).status_code == status


@pytest.mark.parametrize(
    "path", ["/", "/docs", "/assets/search.js", "/api/index", "/nothing", "/openapi.json"]
)
def test_every_answer_carries_the_security_headers(client, path):
    headers = client.get(path).headers
    policy = headers["content-security-policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["x-frame-options"] == "DENY"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["cache-control"]
    assert "access-control-allow-origin" not in headers


@pytest.mark.parametrize(
    "path", ["/assets/../index.py", "/assets/..%2findex.py", "/assets/search.html", "/assets/%2e%2e/model.py"]
)
def test_no_path_of_a_client_is_opened(client, path):
    assert client.get(path).status_code == 404


def test_pages_load_nothing_from_elsewhere(client):
    for path in (
        "/",
        "/docs",
        "/assets/search.js",
        "/assets/search.css",
        "/assets/shared.js",
        "/assets/describe.js",
    ):
        text = client.get(path).text.replace("http://www.w3.org/2000/svg", "")
        assert "http:" not in text
        assert "https:" not in text
        assert " style=" not in text  # The content security policy would refuse it.
        assert "onclick" not in text


def test_the_interface_is_described(client):
    described = client.get("/openapi.json").json()
    assert set(described["paths"]) == {
        "/api/index",
        "/api/sample",
        "/api/items/{item}/preview",
        "/api/query",
        "/api/shared",
    }
    query = described["paths"]["/api/query"]["post"]
    assert {"400", "401", "408", "409", "413", "422", "429"} <= set(query["responses"])
    assert query["responses"]["422"]["content"]["application/json"]["schema"]["$ref"].endswith("/Problem")


def test_an_error_that_nobody_foresaw_is_told_without_its_insides(index, monkeypatch):
    app = create_app(index)
    monkeypatch.setattr(ShapeIndex, "labels", lambda _: 1 / 0)
    with opened(app, raise_server_exceptions=False) as client:
        answer = client.get("/api/index")
    assert answer.status_code == 500
    assert answer.json() == {"error": "the service failed; its log says why"}
    assert answer.headers["x-frame-options"] == "DENY"


PATHS = st.sampled_from(
    ["/", "/docs", "/assets/{}", "/api/index", "/api/sample?count={}", "/api/items/{}/preview", "/api/query",
     "/api/shared", "/openapi.json", "/{}"]
)  # fmt: skip
WORDS = st.one_of(
    st.integers(-(2**70), 2**70).map(str),
    st.text(max_size=20),
    st.sampled_from(["1", "2", "NaN", "1e3", "-0", "%00", "..%2f", "\udcff", "\x00", "lakes", "true"]),
).map(lambda text: text.encode("utf-8", "surrogatepass"))
BODIES = st.one_of(
    st.binary(max_size=60),
    st.sampled_from(
        [JPEG, JPEG[:700], bomb(), encoded(scene(1)), b"GIF89a\x00\x00\x00\x00", b"BM", b"P5 9 9 255"]
    ),
    st.tuples(st.integers(0, len(JPEG) - 1), st.integers(1, 255)).map(
        lambda flip: JPEG[: flip[0]] + bytes([JPEG[flip[0]] ^ flip[1]]) + JPEG[flip[0] + 1 :]
    ),
)


@st.composite
def multipart(draw) -> tuple[bytes, bytes]:
    boundary = draw(st.sampled_from([b"x", b"----a b", b"", b'"q"']))
    parts = []
    for name in draw(
        st.lists(st.sampled_from([b"image", b"count", b"label", b"item", b"", b"\xff"]), max_size=5)
    ):
        file = b'; filename="a.jpg"' if draw(st.booleans()) else b""
        value = draw(BODIES if name == b"image" else WORDS)
        head = b'Content-Disposition: form-data; name="' + name + b'"' + file
        parts.append(b"--" + boundary + b"\r\n" + head + b"\r\n\r\n" + value + b"\r\n")
    body = b"".join(parts) + (b"--" + boundary + b"--\r\n" if draw(st.booleans()) else b"")
    return body, b"multipart/form-data; boundary=" + boundary


REQUESTS = st.one_of(
    multipart(),
    st.tuples(BODIES, st.sampled_from([b"application/json", b"multipart/form-data", b"", b"a/b; charset=no",
                                       b"application/x-www-form-urlencoded"])),
)  # fmt: skip


@settings(max_examples=250)
@given(
    method=st.sampled_from(["GET", "POST", "PUT", "DELETE", "HEAD", "OPTIONS", "PATCH", "TRACE"]),
    path=PATHS,
    word=WORDS,
    request=REQUESTS,
    host=st.sampled_from([b"127.0.0.1", b"localhost:1", b"\xff", b"evil"]),
)
def test_no_request_makes_it_fail(client, method, path, word, request, host):
    """Any exception inside the application is raised here by the test client, too."""
    from urllib.parse import quote_from_bytes

    url = path.replace("{}", quote_from_bytes(word, safe=""))
    answer = client.request(
        method, url, content=request[0], headers={"Content-Type": request[1], "Host": host}
    )
    assert answer.status_code < 500
    if answer.status_code >= 400 and method != "HEAD":
        assert set(answer.json()) == {"error"}


@settings(max_examples=40)
@given(
    fields=st.fixed_dictionaries({}, optional={"count": WORDS, "label": WORDS, "item": WORDS}), data=BODIES
)
def test_no_form_makes_a_query_fail(client, fields, data):
    for path in ("/api/query", "/api/shared"):
        answer = client.post(path, files={"image": ("a", data)}, data=fields)
        assert answer.status_code < 500
