"""`curvify refine`: outputs are opened again and looked at."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import curvify

TORUS = Path(__file__).parents[2] / "sample_meshes" / "torus.obj"


def edge_uses(mesh: curvify.PolygonMesh) -> Counter[int]:
    """How many faces an edge has, and how many edges have so many."""
    uses: Counter[frozenset[int]] = Counter()
    for face in mesh.faces():
        uses.update(frozenset(pair) for pair in zip(face, [*face[1:], face[0]], strict=True))
    return Counter(uses.values())


@pytest.mark.parametrize("name", ["dense.ply", "dense.obj", "dense.off", "dense.PLY"])
def test_a_torus_becomes_dense_closed_and_keeps_its_vertices(call, folder, name):
    result = call("refine", TORUS, name)
    assert (result.code, result.out, result.err) == (0, b"", "")
    coarse, dense = curvify.read(TORUS), curvify.read(folder / name)
    assert dense.face_count == 36 * 4 * 5**2
    assert set(dense.face_sizes) == {4}
    np.testing.assert_array_equal(np.float32(dense.positions[:36]), np.float32(coarse.positions))
    assert set(edge_uses(dense)) == {2}
    assert [path.name for path in folder.iterdir() if path.suffix not in (".obj",)] == (
        [] if name.endswith("obj") else [name]
    )


def test_level_sets_the_number_of_faces(call, folder):
    for level in (1, 3):
        assert call("refine", "cube.obj", "dense.ply", "-k", level).code == 0
        assert curvify.read("dense.ply").face_count == 24 * level**2


def test_a_file_a_pipe_and_any_number_of_threads_give_the_same_bytes(call, folder):
    made = []
    for threads in (1, 2, 3, 2):
        assert call("refine", TORUS, "dense.ply", "-k", "45", "--threads", threads).code == 0
        made.append(Path("dense.ply").read_bytes())
    piped = call("refine", TORUS, "-", "--output-format", "ply", "-k", "45")
    assert piped.err == ""
    assert len(set(made)) == 1
    assert piped.out == made[0]


def test_standard_input_and_output(process, folder):
    given = Path("cube.obj").read_bytes()
    as_ply = process("refine", "-", "-", "--input-format", "obj", "--output-format", "ply", "-k", "1", stdin=given)
    assert (as_ply.code, as_ply.err) == (0, "")
    again = process("refine", "-", "dense.obj", "-k", "1", stdin=as_ply.out)  # PLY is recognized
    assert (again.code, again.out) == (0, b"")
    assert curvify.read("dense.obj").face_count == 24 * 4


def test_ascii(call, folder):
    assert call("refine", "cube.obj", "text.ply", "--ascii").code == 0
    assert call("refine", "cube.obj", "binary.ply").code == 0
    assert Path("text.ply").read_bytes().startswith(b"ply\nformat ascii 1.0\n")
    text, binary = curvify.read("text.ply"), curvify.read("binary.ply")
    np.testing.assert_array_equal(text.positions, binary.positions)
    np.testing.assert_array_equal(text.face_vertices, binary.face_vertices)


def test_triangulate(call, folder):
    assert call("refine", "cube.obj", "dense.ply", "--triangulate").code == 0
    dense = curvify.read("dense.ply")
    assert dense.face_count == 2 * 600
    assert set(dense.face_sizes) == {3}
    assert set(edge_uses(dense)) == {2}


def test_formats_without_polygons_get_triangles(call, folder):
    result = call("refine", "cube.obj", "dense.stl", "-v")
    assert result.code == 0
    assert "1,200 faces" in result.err
    assert curvify.read("dense.stl").face_count == 1200


def test_precision(call, folder):
    curvify.write(curvify.read("cube.obj"), "double.ply", dtype=np.float64)
    expected = {
        ("cube.obj", "input"): "float32",
        ("cube.obj", "float64"): "float64",
        ("double.ply", "input"): "float64",
        ("double.ply", "float32"): "float32",
    }
    for (source, precision), dtype in expected.items():
        assert call("refine", source, "dense.ply", "--precision", precision).code == 0
        assert curvify.read("dense.ply").position_dtype == dtype
    assert call("refine", "double.ply", "dense.ply").code == 0
    assert curvify.read("dense.ply").position_dtype == "float64"


def test_formats_by_option(call, folder):
    Path("cube.obj").rename("cube")
    result = call("refine", "cube", "dense", "--input-format", "OBJ", "--output-format", ".ply")
    assert (result.code, result.err) == (0, "")
    assert curvify.read("dense", "ply").face_count == 600


def test_a_file_can_replace_itself(call, folder):
    assert call("refine", "cube.obj", "cube.obj", "-k", "1").code == 0
    assert curvify.read("cube.obj").face_count == 24


def test_no_clobber(call, folder):
    Path("dense.ply").write_text("mine")
    result = call("refine", "cube.obj", "dense.ply", "--no-clobber")
    assert result.code == 2
    assert "dense.ply" in result.err
    assert Path("dense.ply").read_text() == "mine"
    assert call("refine", "cube.obj", "other.ply", "--no-clobber").code == 0


def test_dry_run_tells_sizes_and_writes_nothing(call, folder):
    before = sorted(folder.iterdir())
    result = call("refine", "cube.obj", "dense.ply", "--dry-run")
    assert (result.code, result.out) == (0, b"")
    assert sorted(folder.iterdir()) == before
    assert "8 vertices, 6 faces" in result.err
    assert "602 vertices, 600 faces" in result.err
    assert call("refine", "cube.obj", "dense.ply", "--dry-run", "-q").err == ""


@pytest.mark.parametrize("options", [[], ["--triangulate"], ["--precision", "float64"]])
def test_dry_run_knows_the_size_of_a_binary_ply_file(call, folder, options):
    from curvify.cli.console import size

    told = call("refine", TORUS, "dense.ply", "--dry-run", *options).err
    assert call("refine", TORUS, "dense.ply", *options).code == 0
    assert f"about {size(Path('dense.ply').stat().st_size)}\n" in told


@pytest.mark.parametrize("name", ["dense.obj", "dense.off", "dense.ply"])
def test_dry_run_guesses_the_size_of_text(folder, name):
    from curvify.cli.predict import predicted_bytes
    from curvify.formats.dense import dense_output
    from curvify.refinement import surface

    made = surface(curvify.read(TORUS))
    for triangulate in (False, True):
        with dense_output(name, ascii=True, triangulate=triangulate) as sink:
            layout = made.stream(sink, 7, np.float32)
        guess = predicted_bytes(layout, Path(name).suffix[1:], True, triangulate)
        assert 0.4 < guess / Path(name).stat().st_size < 1.6


@pytest.mark.parametrize("command", [["dense.ply"], ["dense.ply", "--dry-run"], ["dense.stl"]])
def test_max_faces_counts_what_would_be_written(call, folder, command):
    limit = 1199 if command[0].endswith("stl") else 599
    result = call("refine", "cube.obj", *command, "--max-faces", limit)
    assert result.code == 2
    assert result.err.startswith(f"curvify: error: cube.obj: level 5 gives {limit + 1:,} faces")
    assert not Path(command[0]).exists()
    assert call("refine", "cube.obj", *command, "--max-faces", limit + 1).code == 0


def test_options_reach_the_scheme(call, folder):
    made = {}
    for options in (
        "",
        "--cross-tangent smooth",
        "--cross-tangent linear",
        "--cross-tangent quadratic",
        "--cross-tangent quadratic --alpha 2",
        "--normals paper",
    ):
        assert call("refine", "cube.obj", "dense.ply", *options.split()).code == 0
        made[options] = Path("dense.ply").read_bytes()
    assert len(set(made.values())) == len(made)


def test_split_rule_reaches_the_splitter(call, folder):
    Path("star.obj").write_text(
        "v 0 3 0\nv -1 1 0\nv -3 0 0\nv -1 -1 0\nv 0 -3 0\nv 1 -1 0\nv 3 0 0\nv 1 1 0\nf 1 2 3 4 5 6 7 8\n"
    )
    for rule in ("best", "closest"):
        assert call("refine", "star.obj", f"{rule}.ply", "--split-rule", rule, "-q").code == 0
    assert Path("best.ply").read_bytes() != Path("closest.ply").read_bytes()


def test_weld_and_sharp_from_reach_the_preparation(call, folder):
    seam = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 0\nv 2 0 1\nv 2 1 1\nv 1 1 0\nf 1 2 3 4\nf 5 6 7 8\n"
    Path("seam.obj").write_text(seam)
    sizes = []
    for weld in ("never", "auto"):
        assert call("refine", "seam.obj", "dense.ply", "--weld", weld, "-k", "2").code == 0
        sizes.append(curvify.read("dense.ply").vertex_count)
    assert sizes[0] - sizes[1] == 3  # the points inside the shared edge; the input's own vertices all stay
    normals = "vn 0 0 1\nvn -1 0 1\nf 1//1 2//1 3//1 4//1\nf 2//2 6//2 7//2 3//2\n"
    Path("bent.obj").write_text(seam.split("f")[0] + normals)
    ignored = call("refine", "bent.obj", "smooth.ply")
    assert ignored.code == 0
    assert "warning: bent.obj: " in ignored.err
    assert "--sharp-from normals" in ignored.err
    assert call("refine", "bent.obj", "sharp.ply", "--sharp-from", "normals").err == ""
    assert curvify.read("sharp.ply").vertex_count > curvify.read("smooth.ply").vertex_count


def test_warnings_name_the_input_and_quiet_silences_them(call, folder):
    loud = call("refine", "dart.obj", "dense.ply")
    assert loud.code == 0
    assert loud.err.startswith("curvify: warning: dart.obj: 1 concave face split into convex pieces")
    assert loud.err.count("\n") == 1
    quiet = call("refine", "dart.obj", "dense.ply", "-q")
    assert (quiet.code, quiet.err) == (0, "")


def test_verbose_explains(call, folder):
    said = call("refine", "cube.obj", "dense.ply", "-v", "--threads", "3").err
    for part in ("cube.obj: 8 vertices, 6 faces", "scheme gregory, level 5", "backend cpu, 3 threads", "evaluate"):
        assert part in said
    assert all(line.startswith("curvify: ") for line in said.splitlines())


@pytest.mark.parametrize("backend", ["auto", "cpu"])
def test_backends_that_there_are(call, folder, backend):
    assert call("refine", "cube.obj", "dense.ply", "--backend", backend).code == 0


def test_the_progress_bar_appears_only_for_long_work_on_a_terminal(monkeypatch, capsys):
    import sys

    from curvify.cli import console

    class Terminal:
        """Standard error, as if it were a terminal."""

        def __getattr__(self, name):
            return getattr(stream, name)

        def isatty(self):
            return True

    stream = sys.stderr
    with console.Console().progress("dense.ply") as progress:
        progress(1, 100)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(sys, "stderr", Terminal())
    with console.Console().progress("dense.ply") as progress:
        progress(50, 100)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(console, "PATIENCE", 0.0)
    with console.Console().progress("dense.ply") as progress:
        progress(50, 100)
    assert "dense.ply  50%" in capsys.readouterr().err
    with console.Console(quiet=True).progress("dense.ply") as progress:
        progress(50, 100)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("number", "text"), [(1, "1 byte"), (999, "999 bytes"), (1000, "1 kB"), (999_700, "1 MB"), (45_323, "45.3 kB")]
)
def test_sizes_read_well(number, text):
    from curvify.cli.console import size

    assert size(number) == text
