"""Draw the pictures of the README and the pages beside it: ``python docs/pictures/make_pictures.py [FOLDER]``.

`make pictures` does the same. They are written beside this file unless a folder is given. The same device gives the
same bytes; another one may differ in a last bit here and there.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import curvify
from curvify.formats.marks_json import read_marks
from curvify.gpu.device import Device, open_device
from curvify.gpu.picture import picture, to_png
from curvify.gpu.scene import Layer, Panel, Settings, Stroke
from curvify.simplify import Fit, Options, simplify_and_fit

HERE = Path(__file__).resolve().parent
SAMPLES = HERE.parents[1] / "sample_meshes"
EDGES = Stroke(width=1.2)


def sample(name: str) -> curvify.PolygonMesh:
    """A sample mesh."""
    return curvify.read(SAMPLES / f"{name}.obj")


def refined(device: Device) -> bytes:
    """Coarse meshes and the surfaces made from them, one smooth all over and one with sharp edges."""
    pawn, knob = sample("pawn"), sample("knob")
    hard = read_marks(SAMPLES / "knob-hard.json")
    panels = [
        Panel([Layer(pawn, wire=EDGES)], f"{pawn.face_count} polygons"),
        Panel([Layer(curvify.refine(pawn, level=12))], "their smooth surface"),
        Panel([Layer(knob, wire=EDGES)], f"{knob.face_count} polygons"),
        Panel([Layer(curvify.refine(knob, level=12, marks=hard))], "with some edges sharp"),
    ]
    return to_png(picture(panels, Settings(size=(300, 300), background=None, fit="each"), device))


def reflections(device: Device) -> bytes:
    """Reflection lines of flat faces, of averaged normals, and of the surface."""
    coarse = sample("torus")
    panels = [
        Panel([Layer(coarse, "zebra", "flat")], "flat faces"),
        Panel([Layer(coarse, "zebra", "smooth")], "normals averaged"),
        Panel([Layer(curvify.refine(coarse, level=12), "zebra")], "refined by curvify"),
    ]
    settings = Settings(size=(400, 300), background=None, stripes=8, view=(20.0, 35.0))
    return to_png(picture(panels, settings, device))


def marked(name: str) -> Layer:
    """A sample refined with the marks file of that name, which begins with the name of its mesh."""
    marks = read_marks(SAMPLES / f"{name}.json")
    return Layer(curvify.refine(sample(name.split("-")[0]), level=12, marks=marks))


def rings(device: Device) -> bytes:
    """One ring, six shapes, after figure 15 of the paper that the surface is from."""
    texts = {
        "ring-a-plain": "no marks",
        "ring-b-flat": "flat above and below",
        "ring-c-level": "edge normals",
        "ring-d-cones": "creases, straight edges",
        "ring-e-flat-creased": "flat, and a crease",
        "ring-f-creased": "the crease alone",
    }
    panels = [Panel([marked(name)], text) for name, text in texts.items()]
    return to_png(picture(panels, Settings(size=(240, 190), background=None), device))


def features(device: Device) -> bytes:
    """Smooth and sharp: the mushroom and the pawn, after figures 18 and 19; darts; a rim from soft to hard."""
    panels = [
        Panel([Layer(curvify.refine(sample("mushroom"), level=12))], "mushroom"),
        Panel([marked("mushroom-sharp")], "with creases"),
        Panel([Layer(curvify.refine(sample("pawn"), level=12))], "pawn"),
        Panel([marked("pawn-sharp")], "with creases"),
        Panel([marked("ball-darts")], "creases that fade"),
        Panel([marked("cylinder-soft")], "a rim from soft to hard"),
    ]
    return to_png(picture(panels, Settings(size=(240, 240), background=None, fit="each"), device))


def fitted(device: Device) -> bytes:
    """A dense mesh, polygons made from it, and their surfaces without and with a fit."""
    fine = curvify.refine(sample("knob"), level=10, marks=read_marks(SAMPLES / "knob-hard.json"))
    dense = curvify.PolygonMesh(fine.positions, 4 * np.arange(len(fine.faces) + 1), fine.faces.reshape(-1))
    plain, best = (simplify_and_fit(dense, Options(faces=60), Fit(mode)).mesh for mode in ("none", "full"))
    panels = [
        Panel([Layer(dense, style="zebra")], f"{dense.face_count:,} quads"),
        Panel([Layer(best, wire=EDGES)], f"{best.face_count} fitted polygons"),
        Panel([Layer(curvify.refine(best, level=12), "zebra")], "and their surface"),
        Panel([Layer(curvify.refine(plain, level=12), "zebra")], "without a fit"),
    ]
    return to_png(picture(panels, Settings(size=(300, 300), background=None, stripes=8, fit="each"), device))


PICTURES = {
    "refined.png": refined,
    "reflections.png": reflections,
    "rings.png": rings,
    "features.png": features,
    "fitted.png": fitted,
}


def main(folder: Path) -> None:
    """Write all pictures into a folder, on nothing, so that they suit light and dark pages."""
    with open_device() as device:
        for name, draw in PICTURES.items():
            (folder / name).write_bytes(draw(device))


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
