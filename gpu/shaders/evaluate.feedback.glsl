// Entry for devices without compute shaders: a vertex is a sample, captured by transform feedback in the same order.

out vec3 value;
#if defined(NORMALS)
out vec3 normal;
#endif

void main() {
    vec3 values[TILE * ORDERS];
    matrix_product(gl_VertexID / samples, gl_VertexID % samples, values);
#if defined(UNIT)
    value = unit_normal(values[0]);
#else
    value = scale * values[0];
#endif
#if defined(NORMALS)
    normal = cross_normals(values[1], values[2]);
#endif
}
