"""Flat subdivision (each triangle in four) by trimesh: triangles in OBJ, ITERATIONS times, to binary PLY; without
normals.
"""

import sys

import trimesh

source, target, iterations = sys.argv[1:]
mesh = trimesh.load_mesh(source, process=False, maintain_order=True)
vertices, faces = mesh.vertices, mesh.faces
for _ in range(int(iterations)):
    vertices, faces = trimesh.remesh.subdivide(vertices, faces)
trimesh.Trimesh(vertices, faces, process=False).export(target, vertex_normal=False)
