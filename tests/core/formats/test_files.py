"""Opening, finding and replacing files; OFF; and the formats that go through trimesh."""

from __future__ import annotations

import io
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from curvify.errors import FormatError
from curvify.formats import atomic_file, read_mesh, write_mesh
from curvify.formats.off import read_off
from curvify.mesh import PolygonMesh
from curvify.triangulation import triangle_corners

CUBE = PolygonMesh.from_faces(
    [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)],
    [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]],
)


def names_in(folder: Path) -> list[str]:
    return [entry.name for entry in folder.iterdir()]


@pytest.mark.parametrize("suffix", [".obj", ".PLY", ".Off"])
def test_suffix_decides(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    write_mesh(CUBE, path)
    assert read_mesh(path).faces() == CUBE.faces()
    assert names_in(tmp_path) == [path.name]


def test_standard_streams() -> None:
    for format in ("ply", "off"):
        out = io.BytesIO()
        write_mesh(CUBE, "-", format, stdout=out)
        assert read_mesh("-", stdin=io.BytesIO(out.getvalue())).face_count == 6
    with pytest.raises(FormatError, match="format of standard input"):
        read_mesh("-", stdin=io.BytesIO(b"v 0 0 0\n"))


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("none.obj", "cannot read: there is no such file"),
        ("folder.obj", "cannot read: it is a folder"),
        ("a.xyzzy", "unknown suffix '.xyzzy'; name the format, one of obj, ply, off, stl"),
        ("plain", "the name has no suffix"),
        ("nul\0.obj", "not a file name"),
    ],
)
def test_unreadable_names(tmp_path: Path, name: str, words: str) -> None:
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(FormatError, match=re.escape(words)):
        read_mesh(f"{tmp_path}/{name}")


@pytest.mark.parametrize("name", ["missing/a.obj", "folder.obj", "nul\0.obj"])
def test_unwritable_names(tmp_path: Path, name: str) -> None:
    (tmp_path / "folder.obj").mkdir()
    with pytest.raises(FormatError, match="cannot write"):
        write_mesh(CUBE, f"{tmp_path}/{name}")


@pytest.mark.parametrize("failure", [ValueError, KeyboardInterrupt, SystemExit])
def test_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path, failure: type[BaseException]) -> None:
    target = tmp_path / "a.bin"
    target.write_bytes(b"old")
    with pytest.raises(failure), atomic_file(target) as out:
        out.write(b"new")
        raise failure
    assert target.read_bytes() == b"old"
    assert names_in(tmp_path) == ["a.bin"]


def test_success_replaces_and_keeps_permissions(tmp_path: Path) -> None:
    target, link = tmp_path / "a.bin", tmp_path / "link"
    mask = os.umask(0o027)
    try:
        with atomic_file(target) as out:
            os.pwrite(out.fileno(), b"world", 6)
            os.pwrite(out.fileno(), b"hello ", 0)
    finally:
        os.umask(mask)
    assert target.read_bytes() == b"hello world"
    assert target.stat().st_mode & 0o777 == 0o640
    target.chmod(0o604)
    link.symlink_to(target)
    with atomic_file(link) as out:
        out.write(b"again")
    assert link.is_symlink()
    assert target.read_bytes() == b"again"
    assert target.stat().st_mode & 0o777 == 0o604


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes with names here")
def test_pipes_are_written_straight(tmp_path: Path) -> None:
    pipe = tmp_path / "p.ply"
    os.mkfifo(pipe)
    got: list[bytes] = []
    reader = threading.Thread(target=lambda: got.append(pipe.read_bytes()))
    reader.start()
    write_mesh(CUBE, pipe)
    reader.join(10)
    assert got[0].startswith(b"ply\n")
    assert names_in(tmp_path) == ["p.ply"]


@pytest.mark.skipif(not Path("/dev/stdout").exists(), reason="no /dev/stdout here")
def test_own_standard_output_keeps_its_place(tmp_path: Path) -> None:
    code = (
        "import sys; from curvify.formats import atomic_file\n"
        "with atomic_file('/dev/stdout') as out: out.write(b'two')"
    )
    with (tmp_path / "out").open("wb") as out:
        out.write(b"one ")
        out.flush()
        subprocess.run([sys.executable, "-c", code], stdout=out, check=True)
    assert (tmp_path / "out").read_bytes() == b"one two"


def test_own_formats_do_not_import_trimesh(tmp_path: Path) -> None:
    code = (
        "import sys, curvify.formats as f; m = f.read_mesh(sys.argv[1]); f.write_mesh(m, sys.argv[2])\n"
        "print([n for n in ('trimesh', 'scipy', 'mapbox_earcut') if n in sys.modules])"
    )
    write_mesh(CUBE, tmp_path / "a.obj")
    arguments = [sys.executable, "-c", code, str(tmp_path / "a.obj"), str(tmp_path / "a.ply")]
    assert subprocess.run(arguments, capture_output=True, check=True, text=True).stdout.strip() == "[]"


OFF = b"OFF # shape\n\n# note\n4 2 0\n0 0 0\n1 0 0 # x\n1 1 0\n\n0 1 0\n4 0 1 2 3\n3 0 1 2 255 0 0\n"


def test_off_keeps_polygons_and_tolerates_comments() -> None:
    for data in (OFF, OFF.replace(b"\n", b"\r\n"), OFF.replace(b"OFF # shape\n", b""), b"OFF 0 0 0"):
        mesh = read_off(data, "a.off")
        assert mesh.faces() == ([[0, 1, 2, 3], [0, 1, 2]] if len(data) > 20 else [])


def test_off_prefixes() -> None:
    mesh = read_off(
        b"CNOFF 3 1 0\n0 0 0 0 0 1 255 0 9\n1 0 0 0 0 1 1 2 3\n0 1 0 0 1 0 4 5 6\n3 0 1 2\n", "a.off"
    )
    assert mesh.corner_normals.tolist() == [[0, 0, 1], [0, 0, 1], [0, 1, 0]]
    assert mesh.vertex_colors.dtype == np.uint8
    assert mesh.vertex_colors.tolist() == [[255, 0, 9], [1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "a.off:1: the file is empty"),
        (b"solid\n", "a.off:1: not an OFF file"),
        (b"OFF BINARY\n", "a.off:1: binary OFF"),
        (b"OFF\n4 x 0\n", "a.off:2: the numbers of vertices"),
        (b"OFF\n", "the numbers of vertices"),
        (
            b"OFF\n999999999 2 0\n0 0 0\n",
            "a.off:2: 999999999 vertices and 2 faces are announced, only 1 lines follow",
        ),
        (OFF + b"1 2 3\n", "a.off:12: the file goes on"),
        (OFF.replace(b"3 0 1 2 255", b"3 0 1 4 255"), "a.off:11: face refers to vertex 4, the file has 4"),
        (OFF.replace(b"4 0 1 2 3", b"5 0 1 2 3"), "a.off:10: face has fewer vertices"),
        (OFF.replace(b"1 1 0", b"1 1"), "a.off:7: vertex has 2 numbers"),
        (OFF.replace(b"1 1 0", b"1 inf 0"), "a.off:7: vertex has a coordinate that is not"),
    ],
)
def test_off_errors_name_the_line(data: bytes, words: str) -> None:
    with pytest.raises(FormatError, match=re.escape(words)):
        read_off(data, "a.off")


@pytest.mark.parametrize("suffix", ["stl", "glb"])
def test_other_formats_hold_triangles(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a.{suffix}"
    write_mesh(CUBE, path)
    again = read_mesh(path)
    assert again.face_sizes.tolist() == [3] * 12
    a, b, c = np.moveaxis(again.positions[again.face_vertices].reshape(-1, 3, 3), 1, 0)
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(1)


def test_glb_keeps_normals_and_uvs(tmp_path: Path) -> None:
    normals = np.repeat([[0, 0, -1], [0, 0, 1], [0, -1, 0], [0, 1, 0], [-1, 0, 0], [1.0, 0, 0]], 4, axis=0)
    mesh = CUBE.with_(corner_normals=normals, corner_uvs=np.tile([[0, 0], [0, 1], [1, 1], [1.0, 0]], (6, 1)))
    write_mesh(mesh, tmp_path / "a.glb")
    again = read_mesh(tmp_path / "a.glb")
    corners = triangle_corners(mesh).reshape(-1)
    np.testing.assert_allclose(again.corner_normals, normals[corners], atol=1e-6)
    np.testing.assert_allclose(again.corner_uvs, mesh.corner_uvs[corners], atol=1e-6)


@pytest.mark.parametrize("suffix", ["stl", "glb"])
def test_damaged_other_files_give_one_line(tmp_path: Path, suffix: str) -> None:
    (tmp_path / f"a.{suffix}").write_bytes(b"nothing of the kind" * 20)
    with pytest.raises(FormatError) as caught:
        read_mesh(tmp_path / f"a.{suffix}")
    assert "\n" not in str(caught.value)


def test_concave_polygons_are_cut_without_folding() -> None:
    points = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [2, 1, 0], [0, 4, 0]]
    for shift in range(5):
        mesh = PolygonMesh.from_faces(points, [[(i + shift) % 5 for i in range(5)]])
        a, b, c = (mesh.positions[mesh.face_vertices[triangle_corners(mesh)[:, k]]] for k in range(3))
        areas = np.cross(b - a, c - a)[:, 2] / 2
        assert (areas > 0).all()
        assert areas.sum() == pytest.approx(10)
