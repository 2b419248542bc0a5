"""The sample meshes: reproducible from their script, and as their table says."""

from __future__ import annotations

import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from curvify.mask import read_mask

FOLDER = Path(__file__).resolve().parents[1] / "sample_meshes"
SCRIPT = FOLDER / "make_samples.py"


@dataclass(frozen=True)
class Expected:
    """What a sample is meant to be: its face sizes, its valences, its rim, how planar it is."""

    vertices: int
    faces: int
    corners: int
    sizes: dict[int, int]
    valences: dict[int, int]
    rim: int = 0
    flatness: float = 1e-5
    convex: bool = True
    genus: int = 0


EXPECTED = {
    "torus": Expected(36, 36, 144, {4: 36}, {4: 36}, genus=1),
    "mushroom": Expected(24, 20, 84, {4: 18, 6: 2}, {3: 12, 4: 12}),
    "pawn": Expected(96, 90, 368, {4: 88, 8: 2}, {3: 16, 4: 80}),
    "vase": Expected(70, 61, 250, {4: 60, 10: 1}, {3: 20, 4: 50}, rim=10),
    "dodecahedron": Expected(20, 12, 60, {5: 12}, {3: 20}),
    "truncated_icosahedron": Expected(60, 32, 180, {5: 12, 6: 20}, {3: 60}),
    "mixed": Expected(25, 25, 96, {3: 12, 4: 6, 5: 6, 6: 1}, {3: 12, 4: 6, 5: 6, 6: 1}, flatness=0.04),
    "l_part": Expected(12, 8, 36, {4: 6, 6: 2}, {3: 12}, convex=False),
    "cylinder": Expected(24, 14, 72, {4: 12, 12: 2}, {3: 24}),
    "ring": Expected(48, 48, 192, {4: 48}, {4: 48}, genus=1),
    "ball": Expected(24, 20, 84, {4: 18, 6: 2}, {3: 12, 4: 12}),
    "knob": Expected(48, 42, 176, {4: 40, 8: 2}, {3: 16, 4: 32}),
}
MARKED = (
    "ring-a-plain",
    "ring-b-flat",
    "ring-c-level",
    "ring-d-cones",
    "ring-e-flat-creased",
    "ring-f-creased",
    "mushroom-sharp",
    "pawn-sharp",
    "knob-hard",
    "ball-darts",
    "cylinder-soft",
)

each_sample = pytest.mark.parametrize("name", sorted(EXPECTED))


@dataclass(frozen=True)
class Mesh:
    """The vertices and faces of an OBJ file, read without the library."""

    vertices: npt.NDArray[np.float64]
    faces: list[list[int]]

    def directed_edges(self) -> Counter[tuple[int, int]]:
        """Count how often each directed edge occurs."""
        return Counter(edge for f in self.faces for edge in zip(f, f[1:] + f[:1], strict=True))

    def rim(self) -> dict[int, int]:
        """Return the edges that no face runs the other way, each start with its end."""
        edges = self.directed_edges()
        return {a: b for a, b in edges if (b, a) not in edges}

    def normal(self, face: list[int]) -> npt.NDArray[np.float64]:
        """Return the unit normal of a face, from its vector area."""
        corners = self.vertices[face]
        area = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
        return np.asarray(area / np.linalg.norm(area))

    def volume(self, faces: list[list[int]]) -> float:
        """Return the signed volume between the faces and the origin, positive where they face away."""
        v = self.vertices
        fans = [(f[0], f[i], f[i + 1]) for f in faces for i in range(1, len(f) - 1)]
        return sum(float(v[a] @ np.cross(v[b], v[c])) for a, b, c in fans) / 6.0


def read(name: str) -> Mesh:
    """Read the committed sample of that name."""
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for line in (FOLDER / f"{name}.obj").read_text(encoding="utf-8").splitlines():
        keyword, *values = line.split()
        if keyword == "v":
            vertices.append([float(value) for value in values])
        elif keyword == "f":
            faces.append([int(value) - 1 for value in values])
    return Mesh(np.array(vertices), faces)


def test_script_reproduces_the_committed_files(tmp_path: Path) -> None:
    """The script writes exactly the files that are kept, byte for byte, and no others."""
    target = tmp_path / "made" / "here"
    run = subprocess.run([sys.executable, str(SCRIPT), str(target)], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    made = {path.name: path.read_bytes() for path in target.iterdir()}
    (tmp_path / "disc.png").write_bytes(made.pop("disc.png"))  # how tightly it is packed depends on the library
    here, there = (read_mask(folder / "disc.png").values for folder in (tmp_path, FOLDER))
    np.testing.assert_array_equal(here, there)
    assert set(made) == {f"{name}.obj" for name in EXPECTED} | {f"{name}.json" for name in MARKED}
    assert made == {path.name: path.read_bytes() for end in ("obj", "json") for path in FOLDER.glob(f"*.{end}")}
    assert len(run.stdout.splitlines()) == len(EXPECTED) + len(MARKED) + 1


@each_sample
def test_file_layout(name: str) -> None:
    """A comment and the name lead; then vertices, then faces; decimals are the shortest there are."""
    raw = (FOLDER / f"{name}.obj").read_bytes()
    assert raw.endswith(b"\n")
    assert b"\r" not in raw
    first, second, *rest = raw.decode("ascii").splitlines()
    assert first.startswith("# ")
    assert first.endswith("; written by make_samples.py")
    assert second == f"o {name}"
    keywords = [line.split(" ")[0] for line in rest]
    assert keywords == ["v"] * EXPECTED[name].vertices + ["f"] * EXPECTED[name].faces
    for line in rest[: EXPECTED[name].vertices]:
        for text in line.split(" ")[1:]:
            whole, _, fraction = text.partition(".")
            assert whole.lstrip("-").isdigit()
            assert len(fraction) <= 6
            assert not fraction.endswith("0")
            assert text != "-0"


@each_sample
def test_counts(name: str) -> None:
    """The numbers of vertices, faces and corners, and the sizes of the faces, are as stated."""
    mesh, expected = read(name), EXPECTED[name]
    sizes = [len(face) for face in mesh.faces]
    assert len(mesh.vertices) == expected.vertices
    assert len(sizes) == expected.faces
    assert sum(sizes) == expected.corners
    assert Counter(sizes) == expected.sizes
    assert all(len(set(face)) == len(face) for face in mesh.faces)


@each_sample
def test_table_in_the_readme(name: str) -> None:
    """The table of the samples' README states the same counts."""
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith(f"| `{name}.obj` |")]
    assert len(rows) == 1
    cells = [cell.strip() for cell in rows[0].strip("|").split("|")]
    assert cells[2:4] == [str(EXPECTED[name].faces), str(EXPECTED[name].corners)]


@pytest.mark.parametrize("name", MARKED)
def test_marked_samples_stand_in_the_readme(name: str) -> None:
    """Each marks file has a row in the README's second table, with the mesh that it is for."""
    text = (FOLDER / "README.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith(f"| `{name}.json` |")]
    assert len(rows) == 1
    assert f"`{name.split('-')[0]}.obj`" in rows[0]


@each_sample
def test_manifold_and_consistently_oriented(name: str) -> None:
    """Every directed edge occurs once, and its reverse once but along a rim of one loop."""
    mesh, expected = read(name), EXPECTED[name]
    edges = mesh.directed_edges()
    assert set(edges.values()) == {1}
    rim = mesh.rim()
    assert len(rim) == expected.rim
    if rim:
        start = at = next(iter(rim))
        seen = 0
        while seen == 0 or at != start:
            at = rim[at]
            seen += 1
        assert seen == expected.rim
    undirected = {frozenset(edge) for edge in edges}
    euler = len(mesh.vertices) - len(undirected) + len(mesh.faces)
    assert euler == 2 - 2 * expected.genus - (1 if rim else 0)


@each_sample
def test_one_fan_at_each_vertex(name: str) -> None:
    """The faces round a vertex form one fan, and the valences are as stated."""
    mesh = read(name)
    after: dict[int, dict[int, int]] = {}
    for face in mesh.faces:
        for before, here, following in zip(face[-1:] + face[:-1], face, face[1:] + face[:1], strict=True):
            after.setdefault(here, {})[following] = before
    assert sorted(after) == list(range(len(mesh.vertices)))
    for links in after.values():
        starts = set(links) - set(links.values())
        assert len(starts) <= 1
        start = at = starts.pop() if starts else next(iter(links))
        walked = 0
        while at in links and (walked == 0 or at != start):
            at = links[at]
            walked += 1
        assert walked == len(links)
    valences = [len(set(links) | set(links.values())) for links in after.values()]
    assert Counter(valences) == EXPECTED[name].valences


@each_sample
def test_faces_outward(name: str) -> None:
    """The enclosed volume is positive; the vase gets a lid for this."""
    mesh = read(name)
    rim = mesh.rim()
    lid: list[int] = []
    while rim:
        at = lid[-1] if lid else next(iter(rim))
        following = rim.pop(at)
        lid.append(following)
    lids = [lid[::-1]] if lid else []
    assert mesh.volume(mesh.faces + lids) > 0.1


@each_sample
def test_planar_faces(name: str) -> None:
    """Every corner lies in its face's plane, to a part of the face's radius."""
    mesh = read(name)
    for face in mesh.faces:
        offsets = mesh.vertices[face] - mesh.vertices[face].mean(axis=0)
        radius = np.linalg.norm(offsets, axis=1).max()
        assert np.abs(offsets @ mesh.normal(face)).max() <= EXPECTED[name].flatness * radius


@each_sample
def test_convex_faces(name: str) -> None:
    """No face has a reflex corner but the two outlines of the L, which have one each."""
    mesh = read(name)
    reflex = 0
    for face in mesh.faces:
        corners = mesh.vertices[face]
        incoming = corners - np.roll(corners, 1, axis=0)
        turns = np.cross(incoming, np.roll(incoming, -1, axis=0)) @ mesh.normal(face)
        reflex += int((turns <= 0.0).sum())
    assert reflex == (0 if EXPECTED[name].convex else 2)


@each_sample
def test_distinct_vertices_and_size(name: str) -> None:
    """No two vertices come close, and the mesh is one to three units across, round the z axis."""
    vertices = read(name).vertices
    gaps = np.linalg.norm(vertices[:, None] - vertices[None, :], axis=2)
    assert gaps[np.triu_indices(len(vertices), 1)].min() > 0.05
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    assert 1.0 <= (high - low).max() <= 3.0
    assert np.abs(low + high)[:2].max() < 0.15


@pytest.mark.parametrize("name", ["dodecahedron", "truncated_icosahedron"])
def test_regular_solids(name: str) -> None:
    """All vertices lie on the unit sphere, and all edges are equally long."""
    mesh = read(name)
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1.0).max() < 1e-6
    lengths = [np.linalg.norm(mesh.vertices[a] - mesh.vertices[b]) for a, b in mesh.directed_edges()]
    assert np.ptp(lengths) < 4e-6


def test_mixed_is_not_planar() -> None:
    """The mixed body has faces that are off their planes, unlike all the others."""
    mesh = read("mixed")
    off = [np.ptp(mesh.vertices[face] @ mesh.normal(face)) for face in mesh.faces]
    assert max(off) > 0.01


@pytest.mark.parametrize(("name", "sides"), [("mushroom", 6), ("pawn", 8), ("vase", 10)])
def test_profile_turns_gently(name: str, sides: int) -> None:
    """Along the profile, from the middle of the bottom up, no turn is sharper than 110 degrees."""
    profile = read(name).vertices[::sides][:, [0, 2]]
    steps = np.diff(np.concatenate([[[0.0, profile[0, 1]]], profile]), axis=0)
    heading = np.degrees(np.arctan2(steps[:, 1], steps[:, 0]))
    turns = (np.diff(heading) + 180.0) % 360.0 - 180.0
    assert np.abs(turns).max() < (100.0 if name == "pawn" else 110.5)
