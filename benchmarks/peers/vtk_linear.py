"""Flat subdivision (each triangle in four) by vtk: triangles in OBJ, ITERATIONS times, to binary PLY; no normals."""

import sys

from vtkmodules.vtkFiltersModeling import vtkLinearSubdivisionFilter
from vtkmodules.vtkIOGeometry import vtkOBJReader
from vtkmodules.vtkIOPLY import vtkPLYWriter

source, target, iterations = sys.argv[1:]
reader = vtkOBJReader(file_name=source)
subdivide = vtkLinearSubdivisionFilter(number_of_subdivisions=int(iterations))
writer = vtkPLYWriter(file_name=target)
reader >> subdivide >> writer
writer.SetFileTypeToBinary()
if not writer.Write():
    sys.exit("vtk could not write the file")
