"""Mesh files: one module per format, all read to and written from PolygonMesh."""
