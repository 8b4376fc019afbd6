"""The service as a process of its own server: many clients, slow ones, ones that leave, and what stays behind."""

from __future__ import annotations

import json
import os
import socket
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from tiny_encoder import TinyEncoder, encoded, scene, write_classes

from pliant.errors import InputError
from pliant.retrieval import ServiceLimits, ShapeIndex, add_folder, create_app, serve

pytest.importorskip("faiss")
httpx = pytest.importorskip("httpx")
uvicorn = pytest.importorskip("uvicorn")


class Slow(TinyEncoder):
    """Keeps a worker busy until it is let go."""

    def __init__(self) -> None:
        self.free, self.begun = threading.Event(), threading.Semaphore(0)

    def encode(self, pictures):
        self.begun.release()
        self.free.wait(20)
        return super().encode(pictures)


class Running:
    """A server in a thread, on a port that was free."""

    def __init__(self, app) -> None:
        self.listener = socket.socket()
        self.listener.bind(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.server = uvicorn.Server(uvicorn.Config(app, log_level="error", server_header=False))
        self.thread = threading.Thread(target=self.server.run, kwargs={"sockets": [self.listener]})

    def __enter__(self):
        self.thread.start()
        while not self.server.started:
            time.sleep(0.01)
        self.home = f"http://127.0.0.1:{self.port}"
        return self

    def __exit__(self, *_):
        self.server.should_exit = True
        self.thread.join(20)
        assert not self.thread.is_alive()
        self.listener.close()


@pytest.fixture(scope="module")
def index(tmp_path_factory):
    index = ShapeIndex(model=TinyEncoder())
    add_folder(index, write_classes(tmp_path_factory.mktemp("served"), {"hills": 5, "lakes": 5}))
    return index


def open_files() -> int:
    return len(os.listdir("/proc/self/fd"))


@pytest.mark.skipif(not os.path.isdir("/proc/self/fd"), reason="needs /proc")
def test_many_clients_are_all_answered_rightly_and_leave_nothing_behind(index):
    """Sixteen at a time for three seconds; then the open files and threads are those of an idle server."""
    pictures = [encoded(scene(seed), "JPEG") for seed in range(10)]

    def client(first: int) -> int:
        answered, until = 0, time.monotonic() + 3
        with httpx.Client(base_url=running.home, timeout=60, verify=False) as session:
            while time.monotonic() < until:
                seed = (first + answered) % 10
                answer = session.post(
                    "/api/query", files={"image": ("a.jpg", pictures[seed])}, data={"count": 1}
                )
                assert answer.status_code == 200, answer.text
                assert answer.json()["matches"][0]["name"].endswith(f"/{seed}.jpg")
                answered += 1
        return answered

    with Running(create_app(index)) as running:
        httpx.post(running.home + "/api/query", files={"image": ("a.jpg", pictures[0])})
        time.sleep(0.2)
        before = open_files()
        with ThreadPoolExecutor(16) as pool:
            counts = list(pool.map(client, range(16)))
        assert min(counts) >= 1
        deadline = time.monotonic() + 10
        while open_files() > before and time.monotonic() < deadline:
            time.sleep(0.1)
        assert open_files() <= before
    assert not [thread.name for thread in threading.enumerate() if thread.name.startswith("pliant-search")]


def test_beyond_the_queue_clients_are_told_to_come_again_and_the_page_is_still_served():
    encoder = Slow()
    slow = ShapeIndex(model=encoder)
    slow.add(TinyEncoder().encode([scene(0)]))
    picture = encoded(scene(0))

    def ask(_):
        return httpx.post(running.home + "/api/query", files={"image": ("a.png", picture)}, timeout=60)

    with Running(create_app(slow, limits=ServiceLimits(workers=2, waiting=3))) as running:
        with ThreadPoolExecutor(9) as pool:
            answers = [pool.submit(ask, k) for k in range(9)]
            deadline = time.monotonic() + 20
            while sum(answer.done() for answer in answers) < 4 and time.monotonic() < deadline:
                time.sleep(0.02)
            assert httpx.get(running.home).status_code == 200
            assert httpx.get(running.home + "/api/index").json()["items"] == 1
            encoder.free.set()
            statuses = sorted(answer.result().status_code for answer in answers)
        assert statuses == [200] * 5 + [429] * 4
        refused = next(a.result() for a in answers if a.result().status_code == 429)
        assert refused.headers["retry-after"] == "2"
        assert ask(0).status_code == 200  # The queue is free again.


def test_work_of_clients_that_left_is_not_begun():
    encoder = Slow()
    slow = ShapeIndex(model=encoder)
    slow.add(TinyEncoder().encode([scene(0)]))
    with Running(create_app(slow, limits=ServiceLimits(workers=1, waiting=1))) as running:

        def ask(patience: float):
            picture = {"image": ("a.png", encoded(scene(0)))}
            return httpx.post(running.home + "/api/query", files=picture, timeout=patience)

        with ThreadPoolExecutor(1) as pool:
            first = pool.submit(ask, 60)
            encoder.begun.acquire(timeout=20)
            left, deadline = 0, time.monotonic() + 30
            while left < 3 and time.monotonic() < deadline:
                try:
                    assert ask(0.4).status_code == 429  # The only other place is still taken.
                except httpx.ReadTimeout:
                    left += 1
            assert left == 3
            time.sleep(1)
            encoder.free.set()
            assert first.result().status_code == 200
        assert not encoder.begun.acquire(blocking=False)
        assert ask(60).status_code == 200


def raw(port: int, request: bytes) -> tuple[int, dict]:
    with socket.create_connection(("127.0.0.1", port), timeout=20) as connection:
        connection.sendall(request)
        answer = b""
        while part := connection.recv(65536):
            answer += part
    head, _, body = answer.partition(b"\r\n\r\n")
    return int(head.split()[1]), json.loads(body or b"{}")


def test_a_client_that_sends_too_slowly_is_let_go(index):
    head = (
        b"POST /api/query HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 5000\r\n"
        b"Content-Type: multipart/form-data; boundary=x\r\n\r\n--x\r\n"
    )
    with Running(create_app(index, limits=ServiceLimits(patience=0.3))) as running:
        status, body = raw(running.port, head)
        assert status == 408
        assert "did not arrive within 0.3 s" in body["error"]
        assert httpx.get(running.home).status_code == 200


def test_a_length_that_promises_too_much_is_refused_before_it_is_read(index):
    head = b"POST /api/query HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 99999999999\r\n\r\n"
    with Running(create_app(index)) as running:
        assert raw(running.port, head)[0] == 413


def test_serve_says_where_it_is_and_answers_there(index, tmp_path, monkeypatch):
    index.save(tmp_path / "index")
    monkeypatch.setattr("pliant.retrieval.RetrievalModel.load", lambda _: TinyEncoder())
    servers, said = [], []
    run = uvicorn.Server.run
    monkeypatch.setattr(uvicorn.Server, "run", lambda self, **kw: (servers.append(self), run(self, **kw))[1])

    def ready(address: str) -> None:
        said.append(address)
        port = int(address.rstrip("/").rpartition(":")[2])
        socket.create_connection(("127.0.0.1", port), timeout=5).close()  # Who is told can connect at once.

    thread = threading.Thread(target=serve, args=[tmp_path / "index"], kwargs={"port": 0, "ready": ready})
    thread.start()
    while not (servers and servers[0].started):
        assert thread.is_alive()
        time.sleep(0.01)
    answer = httpx.get(said[0] + "api/index")
    servers[0].should_exit = True
    thread.join(20)
    assert answer.json()["items"] == 10
    assert "server" not in answer.headers


@pytest.mark.parametrize("port", [-1, 70000])
def test_a_port_that_there_is_not_is_refused(index, tmp_path, monkeypatch, port):
    index.save(tmp_path / "index")
    monkeypatch.setattr("pliant.retrieval.RetrievalModel.load", lambda _: TinyEncoder())
    with pytest.raises(InputError, match="cannot be bound"):
        serve(tmp_path / "index", port=port)


def test_a_port_that_is_taken_is_refused(index, tmp_path, monkeypatch):
    index.save(tmp_path / "index")
    monkeypatch.setattr("pliant.retrieval.RetrievalModel.load", lambda _: TinyEncoder())
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with pytest.raises(InputError, match="cannot be bound"):
            serve(tmp_path / "index", port=taken.getsockname()[1])
