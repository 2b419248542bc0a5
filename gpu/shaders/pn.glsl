// Twins of core/schemes/pn.py.

#include "triangles"

mat3x4 cubic_curves(Edge edge) {
    vec3 out_leg, back_leg;
    projected_legs(edge, out_leg, back_leg);
    return bezier(vec3(0.0), out_leg / 3.0, edge.chord - back_leg / 3.0, edge.chord);
}

vec3 reflected_normals(Edge edge) {
    vec3 along = unit_rows(edge.chord), total = edge.start_normal + edge.end_normal;
    return unit_rows(total - 2.0 * dot(along, total) * along);
}

void edge_record(int side, out vec4 texels[EDGE_TEXELS]) {
    Edge edge = edge_frame(side);
    bool made = length(edge.chord) >= LEAST_EDGE;
    mat3x4 none = mat3x4(0.0);
    store_edge(made ? cubic_curves(edge) : none, made ? quadratic_fields(edge, reflected_normals(edge)) : none, texels);
}

// cubic_controls: corners, first and second points of the sides, the center.
vec3 column(int row, int first, int index) {
    if (index < 3) {
        return corner_point(first, first + index);
    }
    if (index < 9) {
        return outline_point(first, index % 3, index / 3);
    }
    vec3 total = vec3(0.0);
    for (int k = 0; k < 3; k++) {
        total += (outline_point(first, k, 1) + outline_point(first, k, 2)) / 4.0 - corner_point(first, first + k) / 6.0;
    }
    return total;
}
