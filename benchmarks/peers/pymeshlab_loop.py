"""Loop subdivision by pymeshlab: triangles in OBJ, ITERATIONS times, to PLY with normals."""

import sys

import pymeshlab

source, target, iterations = sys.argv[1:]
meshes = pymeshlab.MeshSet()
meshes.load_new_mesh(source)
meshes.meshing_surface_subdivision_loop(iterations=int(iterations), threshold=pymeshlab.PercentageValue(0.0))
meshes.compute_normal_per_vertex()
meshes.save_current_mesh(
    target,
    binary=True,
    save_vertex_normal=True,
    save_vertex_color=False,
    save_vertex_quality=False,
    save_face_color=False,
    save_wedge_color=False,
    save_wedge_texcoord=False,
    save_wedge_normal=False,
)
