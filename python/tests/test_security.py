"""Promises of docs/security.md that the crates do not test, and the existence of the tests that the
page names."""

import http.client
import os
import re
import socket
import subprocess
import urllib.parse
import urllib.request

import morgana
import numpy as np
import pytest
from conftest import PROGRAM, ROOT, load, small

PAGE = ROOT / "docs/security.md"


def rows():
    """Returns the rows of the page's tables: promise and test."""
    cells = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.read_text().splitlines() if line.startswith("| ")]
    return [(row[0], row[-1]) for row in cells if row[0] != "promise"]


@pytest.mark.parametrize(("promise", "tests"), rows(), ids=lambda text: text[:40])
def test_promises_name_tests_that_exist(promise, tests):
    folder, named = None, re.findall(r"`([^`]+)`", tests)
    assert named, promise
    for name in named:
        # After a first path, further files of its folder are named without it.
        roots = [ROOT / "crates", ROOT] if "/" in name else [folder]
        found = [root / name for root in roots if (root / name).exists()]
        assert found, name
        folder = found[0].parent
        files = [found[0]] if found[0].is_file() else [*found[0].rglob("*.rs")]
        assert found[0].parts[-2:] == ("data", "hostile") or any("#[test]" in f.read_text() or "def test_" in f.read_text() for f in files), name


@pytest.fixture
def picture(tmp_path):
    path = tmp_path / "folder" / "a.exr"
    path.parent.mkdir()
    morgana.render(load(small()), spp=2).write(path)
    return path


def own_address():
    """Returns an address of this machine that other machines may reach; `None` without a network."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # Sends nothing.
        except OSError:
            return None
        return probe.getsockname()[0]


def test_only_this_machine_is_served(serve, picture):
    address = urllib.parse.urlsplit(serve("view", picture))
    assert address.hostname in ("127.0.0.1", "localhost")
    others = [host for host in ("127.0.0.2", own_address()) if host]
    for host in others:
        with pytest.raises(OSError, match="refused"):
            socket.create_connection((host, address.port), timeout=5)


def test_a_page_cannot_make_the_program_write(serve, picture):
    before = {path: path.read_bytes() for path in picture.parent.iterdir()}
    address = urllib.parse.urlsplit(serve("view", picture, cwd=picture.parent))
    with urllib.request.urlopen(f"{address.geturl()}api/0/about") as answer:
        assert answer.status == 200
    for method in ("POST", "PUT", "PATCH", "DELETE"):
        for path in ("api/0/command", "api/0/image.exr", "api/0/about", "a.exr", "../a.exr", "new.exr"):
            connection = http.client.HTTPConnection(address.netloc, timeout=10)
            connection.request(method, f"{address.path}{path}", body=b'{"path": "new.exr"}')
            assert connection.getresponse().status >= 400, (method, path)
            connection.close()
    assert {path: path.read_bytes() for path in picture.parent.iterdir()} == before


@pytest.mark.parametrize("command", ["schema", "completions bash", "help render"])
def test_a_pipe_that_nobody_reads_ends_the_output_quietly(command, tmp_path):
    reading, writing = os.pipe()
    os.close(reading)
    try:
        done = subprocess.run([PROGRAM, *command.split()], cwd=tmp_path, stdout=writing, stderr=subprocess.PIPE, text=True, timeout=30)
    finally:
        os.close(writing)
    assert "panic" not in done.stderr and "Broken pipe" not in done.stderr, done.stderr


def test_denoising_works_in_a_folder_of_its_own(picture, tmp_path):
    """The denoiser's folder is private to its user, and is removed afterwards, whether the denoiser
    succeeds or not."""
    place, log = tmp_path / "temporary", tmp_path / "log"
    place.mkdir()
    stand_in = tmp_path / "stand_in.sh"
    for status in (0, 3):
        stand_in.write_text(
            '#!/bin/sh\nwhile [ $# -gt 1 ]; do case "$1" in --hdr) in=$2;; -o) out=$2;; esac; shift 2; done\n'
            f'stat -c "%a %n" "$(dirname "$in")" >> {log}\ncp "$in" "$out"\nexit {status}\n'
        )
        stand_in.chmod(0o700)
        command = [PROGRAM, "denoise", picture, "--oidn", stand_in, "-o", tmp_path / f"b{status}.exr"]
        done = subprocess.run(command, env={**os.environ, "TMPDIR": str(place)}, capture_output=True, text=True)
        assert (done.returncode == 0) == (status == 0), done.stderr
        assert list(place.iterdir()) == []
    lines = log.read_text().splitlines()
    assert len(lines) == 2 and all(line.startswith(f"700 {place}/") for line in lines), lines


def jpeg(width, height):
    """Returns the start of a baseline JPEG of one component, with a few bytes of data."""
    size = height.to_bytes(2, "big") + width.to_bytes(2, "big")
    tables = b"\xff\xdb\x00\x43\x00" + b"\x01" * 64
    frame = b"\xff\xc0\x00\x0b\x08" + size + b"\x01\x01\x11\x00"
    huffman = b"\xff\xc4\x00\x14\x00" + b"\x01" + b"\x00" * 15 + b"\x00" + b"\xff\xc4\x00\x14\x10" + b"\x01" + b"\x00" * 15 + b"\x00"
    return b"\xff\xd8" + tables + frame + huffman + b"\xff\xda\x00\x08\x01\x01\x00\x00\x3f\x00" + b"\x00" * 64 + b"\xff\xd9"


def test_a_jpeg_takes_no_more_memory_than_it_may(tmp_path):
    (tmp_path / "small.jpg").write_bytes(jpeg(16, 16))
    assert np.asarray(morgana.read(tmp_path / "small.jpg").layers[""]).shape[:2] == (16, 16)
    (tmp_path / "large.jpg").write_bytes(jpeg(60000, 60000))
    scene = '<scene version="3.0.0"><sensor type="perspective"/><emitter type="envmap"><string name="filename" value="large.jpg"/></emitter></scene>'
    (tmp_path / "scene.xml").write_text(scene)
    limited = ["sh", "-c", 'ulimit -v 1000000; exec "$@"', "sh", PROGRAM, "check", "scene.xml"]
    done = subprocess.run(limited, cwd=tmp_path, capture_output=True, text=True, timeout=30)
    assert done.returncode == 2 and "large.jpg" in done.stderr and "memory" in done.stderr, done.stderr
