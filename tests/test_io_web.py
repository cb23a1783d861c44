"""COPC files on a server: what is fetched of them, and what servers do."""

from __future__ import annotations

import re
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import divespot
from divespot import DivespotError
from divespot import io as dio

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

PLAN = (515_383.8, 4_918_359.2, 515_385.8, 4_918_361.2)


class Server(ThreadingHTTPServer):
    """Serves the files that it was given, and counts bytes and requests."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.files: dict[str, bytes] = {}
        self.sent = self.requests = 0
        self.knows_ranges = True
        self.most = 1 << 40

    def url(self, name: str) -> str:
        return f"http://127.0.0.1:{self.server_port}/{name}"


class Handler(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        server: Any = self.server
        data = server.files.get(self.path[1:])
        if data is None:
            return self.send_error(404)
        found = re.match(r"bytes=(\d+)-(\d+)", self.headers["Range"])
        assert found
        begin, end = int(found[1]), min(int(found[2]) + 1, len(data))
        if server.knows_ranges:
            self.send_response(206)
            self.send_header("Content-Range", f"bytes {begin}-{end - 1}/{len(data)}")
        else:
            self.send_response(200)
        part = data[begin:end][: server.most]
        self.send_header("Content-Length", str(len(part)))
        self.end_headers()
        self.wfile.write(part)
        server.sent += len(part)
        server.requests += 1
        return None

    def log_message(self, *_args: object) -> None:
        pass


@pytest.fixture
def server() -> Iterator[Server]:
    with Server() as running:
        thread = threading.Thread(target=running.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield running
        running.shutdown()
        thread.join()


@pytest.fixture
def copc(real_scan: Callable[[str], Path], server: Server) -> bytes:
    data = real_scan("lone-star.copc.laz").read_bytes()
    server.files["a.copc.laz"] = data
    return data


def test_the_points_of_a_rectangle_are_fetched_and_no_others(
    copc: bytes, server: Server, tmp_path: Path
) -> None:
    path = tmp_path / "a.copc.laz"
    path.write_bytes(copc)
    here, there = (dio.read(p, plan=PLAN) for p in (path, server.url("a.copc.laz")))
    assert len(there.points) > 1000
    assert (np.sort(here.points, axis=0) == np.sort(there.points, axis=0)).all()
    assert (there.crs, there.unit, there.format) == (here.crs, here.unit, here.format)
    assert server.sent < len(copc) / 2
    assert server.requests < 20
    everything = (0.0, 0.0, 1e7, 1e7)
    assert len(dio.read(server.url("a.copc.laz"), plan=everything).points) == 518_862


def said_of(source: str, crop: tuple[float, ...]) -> Any:  # noqa: ANN401
    """Return the piles, or why there are none: a geyser's cone need have no ground around it."""
    try:
        return divespot.measure(source, crop=crop).to_dict()["piles"]
    except DivespotError as error:
        return str(error)


def test_a_crop_says_which(copc: bytes, server: Server, tmp_path: Path) -> None:
    path = tmp_path / "a.copc.laz"
    path.write_bytes(copc)
    crop = (*PLAN[:2], 0.0, *PLAN[2:], 3000.0)
    here, there = (said_of(p, crop) for p in (str(path), server.url("a.copc.laz")))
    assert here == there
    with pytest.raises(DivespotError, match=r"http://.*: is on a server: a crop .* is needed"):
        divespot.measure(server.url("a.copc.laz"))
    with pytest.raises(DivespotError, match="no point is inside"):
        dio.read(server.url("a.copc.laz"), plan=(0, 0, 1, 1))


def test_what_servers_do_is_one_sentence(copc: bytes, server: Server) -> None:
    def refused(name: str = "a.copc.laz") -> str:
        with pytest.raises(DivespotError) as error:
            dio.read(server.url(name), plan=PLAN)
        return str(error.value)

    assert "the server refuses (404" in refused("none.laz")
    server.files["a.laz"] = b"<html>" * 100
    assert "is no COPC file" in refused("a.laz")
    server.files["a.laz"] = copc[: len(copc) // 2]
    assert "truncated" in refused("a.laz")
    server.most = 1000
    assert "less than was asked for" in refused()
    server.most, server.knows_ranges = 1 << 40, False
    assert "sends no ranges" in refused()
    with pytest.raises(DivespotError, match="cannot be reached"):
        dio.read("http://127.0.0.1:1/a.copc.laz", plan=PLAN)
    with pytest.raises(DivespotError, match="columns"):
        dio.read(server.url("a.copc.laz"), plan=PLAN, columns="1,2,3")


def test_damaged_octrees_are_refused(copc: bytes, server: Server) -> None:
    rng = np.random.default_rng(0)
    for _ in range(12):
        data = bytearray(copc)
        ends = rng.integers(0, 400, 6), len(data) - rng.integers(1, 30_000, 30)
        for at in np.concatenate(ends):
            data[at] = rng.integers(256)
        server.files["b.laz"] = bytes(data)
        try:
            dio.read(server.url("b.laz"), plan=PLAN)
        except DivespotError as error:
            assert len(str(error)) <= 500  # noqa: PT017 - it may as well be read


def test_points_of_a_server_are_written_with_what_they_are_of(
    copc: bytes, server: Server, tmp_path: Path
) -> None:
    assert copc
    crop = (PLAN[0] - 9, PLAN[1] - 9, 2300.0, PLAN[2] + 9, PLAN[3] + 9, 2400.0)
    report = divespot.measure(server.url("a.copc.laz"), crop=crop)
    report.save(tmp_path / "out.laz")
    # The crop is one in height too; beyond it points are none of a pile.
    assert len(dio.read(tmp_path / "out.laz").points) >= report.source.points
    assert report.source.path == server.url("a.copc.laz")
