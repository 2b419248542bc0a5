"""What the marked samples must be: the six rings of the paper's figure 15, and the others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import curvify
from curvify.formats.marks_json import read_marks
from curvify.quality import EdgeAngles, edge_angles
from surfaces import check_sound

FOLDER = Path(__file__).resolve().parents[1] / "sample_meshes"
MARKED = sorted(path.stem for path in FOLDER.glob("*-*.json"))
RINGS = [name for name in MARKED if name.startswith("ring")]
#: Bands of ring.obj that are its top and its bottom, and the rings that bound them.
LEVEL_BANDS, LEVEL_RINGS = (1, 4), (1, 2, 4, 5)


def make(name: str, **options: object) -> curvify.Surface:
    mesh = curvify.read(FOLDER / f"{name.split('-')[0]}.obj")
    return curvify.surface(mesh, marks=read_marks(FOLDER / f"{name}.json"), **options)


def edges_round(surface: curvify.Surface, ring: int, sides: int = 8) -> np.ndarray:
    """Ids of the edges round a ring."""
    return np.flatnonzero((surface.patches.topology.edges // sides == ring).all(axis=1))


def rungs(surface: curvify.Surface, sides: int = 8) -> np.ndarray:
    """Ids of the edges between rings."""
    edges = surface.patches.topology.edges // sides
    return np.flatnonzero(edges[:, 0] != edges[:, 1])


def creases(surface: curvify.Surface, name: str) -> np.ndarray:
    """Whether each edge is marked as a crease ``(E,)``."""
    pairs = {tuple(sorted(pair)) for pair in read_marks(FOLDER / f"{name}.json").crease_edges.tolist()}
    return np.array([tuple(sorted(pair)) in pairs for pair in surface.patches.topology.edges.tolist()])


def heights(surface: curvify.Surface, band: int) -> np.ndarray:
    """Heights of the dense mesh over a band of faces of the ring."""
    dense = surface.refine(4)
    assert dense.source_faces is not None
    return dense.positions[dense.faces[dense.source_faces // 8 == band], 2]


def angles_of(found: EdgeAngles, edges: np.ndarray) -> np.ndarray:
    return found.angles[np.isin(found.edges, edges)]


@pytest.mark.parametrize("name", MARKED)
@pytest.mark.parametrize("kind", ["precise", "smooth", "linear"])
def test_marked_samples_are_sound_and_smooth_where_nothing_is_marked(name: str, kind: str) -> None:
    surface = make(name, cross_tangent=kind)
    assert surface.warnings == []
    found = edge_angles(surface.patches)
    rims = creases(surface, name)
    flat = read_marks(FOLDER / f"{name}.json").flat_faces
    topology = surface.patches.topology
    rims[topology.edge[np.isin(topology.faces, flat)]] = True
    if "ring" in name:  # flat faces side by side are one plane
        rims[rungs(surface)] = False
    assert angles_of(found, np.flatnonzero(~rims)).max() < 1e-6
    assert found.gaps.max() < 1e-14
    check_sound(surface.refine(2), closed=True)


def test_ring_a_is_the_mesh_without_marks() -> None:
    plain = curvify.surface(curvify.read(FOLDER / "ring.obj"))
    assert np.array_equal(make("ring-a-plain").patches.edges.curves, plain.patches.edges.curves)
    assert np.ptp(heights(plain, 1)) > 0.05


@pytest.mark.parametrize("name", ["ring-b-flat", "ring-e-flat-creased"])
def test_ring_b_and_e_have_a_planar_top_and_bottom_with_round_rims(name: str) -> None:
    surface = make(name)
    for band in LEVEL_BANDS:
        assert np.ptp(heights(surface, band)) < 1e-12
    for ring in LEVEL_RINGS:
        curves = surface.patches.edges.curves[:, edges_round(surface, ring)]
        middle = (curves @ np.array([1, 3, 3, 1])) / 8
        radius = np.hypot(*curves[:2, :, 0])
        assert np.abs(np.hypot(*middle[:2]) / radius - 1).max() < 1e-5


def test_ring_c_has_its_edges_around_the_axis_in_level_planes() -> None:
    level, plain = make("ring-c-level"), make("ring-a-plain")
    spreads = {
        which: [np.ptp(s.patches.edges.curves[2, edges_round(s, ring)]) for ring in LEVEL_RINGS]
        for which, s in (("level", level), ("plain", plain))
    }
    assert max(spreads["level"]) < 1e-12
    assert min(spreads["plain"]) > 0.02
    assert edge_angles(level.patches).smooth.all()


def test_ring_d_is_made_of_cones() -> None:
    surface = make("ring-d-cones")
    start, first, last, end = np.moveaxis(surface.patches.edges.curves[:, rungs(surface)], 2, 0)
    along = (end - start) / np.linalg.norm(end - start, axis=0)
    for point in (first, last):
        assert np.linalg.norm(np.cross(point - start, along, axis=0), axis=0).max() < 1e-12
    for ring in range(6):
        assert np.ptp(surface.patches.edges.curves[2, edges_round(surface, ring)]) < 1e-12
    dense = surface.refine(4)
    assert dense.source_faces is not None
    for band in range(6):  # the cones themselves, to the accuracy of the patches
        points = dense.positions[dense.faces[dense.source_faces // 8 == band]].reshape(-1, 3)
        (r, z), (s, h) = ((1 + 0.4 * np.cos(a), 0.4 * np.sin(a)) for a in np.pi / 3 * np.array([band, band + 1]))
        normal = np.array([h - z, r - s]) / np.hypot(h - z, r - s)
        off = (np.hypot(points[:, 0], points[:, 1]) - r) * normal[0] + (points[:, 2] - z) * normal[1]
        assert np.abs(off).max() < 2.5e-3


@pytest.mark.parametrize("name", ["ring-e-flat-creased", "ring-f-creased"])
def test_ring_e_and_f_have_a_crease_around_the_outside(name: str) -> None:
    surface = make(name)
    found = edge_angles(surface.patches)
    outside = angles_of(found, edges_round(surface, 0))
    assert outside.shape == (8, 5)
    # At the vertices the bands turn by 60 degrees, as the sides of the tube do; a little more in between.
    top = surface.patches.normals[surface.patches.topology.vertices < 8]
    lean = np.degrees(np.arctan2(np.abs(top[:, 2]), np.hypot(*top[:, :2].T)))
    assert np.abs(lean - 30).max() < 1e-4
    assert 60 < outside.min() < outside.max() < 64.1
    if name == "ring-f-creased":
        assert (~found.smooth).sum() == 8


def test_the_mushroom_and_the_pawn_have_their_creases() -> None:
    for name, sides, rings in (("mushroom-sharp", 6, (0, 1, 2)), ("pawn-sharp", 8, (0, 2, 3, 5, 6, 7, 8))):
        surface = make(name)
        found = edge_angles(surface.patches)
        for ring in rings:
            assert angles_of(found, edges_round(surface, ring, sides)).min() > 25
        assert (~found.smooth).sum() == sides * len(rings)


def test_the_knob_has_flat_ends_round_rims_and_straight_walls() -> None:
    surface = make("knob-hard")
    dense = surface.refine(4)
    assert dense.source_faces is not None
    for face, height in ((0, 0.0), (41, 1.0)):
        assert np.abs(dense.positions[dense.faces[dense.source_faces == face], 2] - height).max() < 1e-14
    start, first, last, end = np.moveaxis(surface.patches.edges.curves[:, rungs(surface)], 2, 0)
    along = (end - start) / np.linalg.norm(end - start, axis=0)
    assert np.linalg.norm(np.cross(first - start, along, axis=0), axis=0).max() < 1e-12
    assert np.linalg.norm(np.cross(last - start, along, axis=0), axis=0).max() < 1e-12
    assert angles_of(edge_angles(surface.patches), np.arange(1000)).shape[0] == 88


def test_the_balls_creases_fade_at_their_ends() -> None:
    surface = make("ball-darts")
    found = edge_angles(surface.patches, places=(0.001, 0.5, 0.999))
    sharp = found.angles[~found.smooth]
    ends = np.isin(surface.patches.topology.edges[found.edges[~found.smooth]] // 6, (0, 3)).any(axis=1)
    assert len(sharp) == 9
    assert sharp[:, 1].min() > 10
    assert np.minimum(sharp[ends, 0], sharp[ends, 2]).max() < 0.2
    assert sharp[~ends].min() > 30


def test_the_soft_rim_runs_from_nothing_to_a_right_angle() -> None:
    surface = make("cylinder-soft")
    found = edge_angles(surface.patches)
    lower, upper = (angles_of(found, edges_round(surface, ring, 12)).mean(axis=1) for ring in (0, 1))
    assert np.abs(lower - 90).max() < 1e-9
    assert upper.min() < 20
    assert upper.max() > 75
    assert len(np.unique(np.round(upper, 3))) == 6
