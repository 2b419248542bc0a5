"""Flat subdivision (each triangle in four) by libigl: triangles in OBJ, ITERATIONS times, to binary PLY; no normals."""

import sys

import igl

source, target, iterations = sys.argv[1:]
vertices, faces = igl.read_triangle_mesh(source)
vertices, faces = igl.upsample(vertices, faces, int(iterations))
igl.write_triangle_mesh(target, vertices, faces, igl.FileEncoding.Binary)
