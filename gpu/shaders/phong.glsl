// Twins of core/schemes/phong.py.

#include "triangles"

uniform float alpha;

mat3x4 quadratic_curves(Edge edge) {
    vec3 out_leg, back_leg;
    projected_legs(edge, out_leg, back_leg);
    vec3 middle = edge.chord / 2.0 + alpha / 2.0 * (out_leg - back_leg);
    return bezier(vec3(0.0), middle, edge.chord, vec3(0.0));
}

void edge_record(int side, out vec4 texels[EDGE_TEXELS]) {
    Edge edge = edge_frame(side);
    bool made = length(edge.chord) >= LEAST_EDGE;
    mat3x4 none = mat3x4(0.0);
    vec3 middle = (edge.start_normal + edge.end_normal) / 2.0;
    store_edge(made ? quadratic_curves(edge) : none, made ? quadratic_fields(edge, middle) : none, texels);
}

vec3 column(int row, int first, int index) {
    return index < 3 ? corner_point(first, first + index) : outline_point(first, index - 3, 1);
}
