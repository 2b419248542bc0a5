// What the schemes over triangles share; twins of core/schemes/triangles.py.

#include "edges"

struct Edge {
    vec3 chord;
    vec3 start_normal, end_normal;
    vec3 start_tangent, end_tangent;
    vec3 other;  // a further vector of a sharp feature, or zero
};

Edge edge_frame(int side) {
    ivec4 ends = side_at(side);
    Edge edge;
    edge.chord = difference(ends.x, ends.y);
    edge.start_normal = normal_at(ends.z);
    edge.end_normal = normal_at(ends.w);
    int row = feature_at(side);
    if (row < 0) {
        vec3 along = unit_rows(edge.chord);
        edge.start_tangent = projected_tangents(along, edge.start_normal);
        edge.end_tangent = projected_tangents(along, edge.end_normal);
        edge.other = vec3(0.0);
    } else {
        edge.start_tangent = vector_at(row, 0);
        edge.end_tangent = vector_at(row, 1);
        edge.other = vector_at(row, 2);
    }
    return edge;
}

void projected_legs(Edge edge, out vec3 start, out vec3 end) {
    start = dot(edge.chord, edge.start_tangent) * edge.start_tangent;
    end = dot(edge.chord, edge.end_tangent) * edge.end_tangent;
}

mat3x4 quadratic_fields(Edge edge, vec3 middle) {
    vec3 inner = edge.other == vec3(0.0) ? middle : edge.other;
    return bezier(edge.start_normal, inner, edge.end_normal, vec3(0.0));
}

// Point of the curve of side k of a triangle, from its first corner.
vec3 outline_point(int first, int k, int i) {
    return corner_point(first, first + k) + bezier_point(side_curve(first + k), i);
}

vec3 normal_column(int row, int first, int index) {
    return index < 3 ? corner_normal(first + index) : bezier_point(side_field(first + index - 3), 1);
}

bool is_built(int row, int first) {
    return sides_made(first);
}
