// What control vectors are built from, see core/schemes/construction.py, and the curves of the edges, once they are made.
// Positions are whole numbers: their differences are exact, however far apart the rest of the mesh lies.
// A mat3x4 holds four vectors, a column for each component; a row vector of weights times it is their sum.

#include "records"

uniform isampler2D positions;  // of vertices, in GRID
uniform sampler2D normals;     // distinct corner normals
uniform isampler2D sides;      // vertices at start and end, normals there
uniform isampler2D features;   // row of vectors, or -1
uniform sampler2D vectors;     // VECTORS of them in a row
uniform isampler2D corners;    // twice the side, plus 1 where the half-edge runs backward
uniform sampler2D edges;       // EDGE_TEXELS a side: curve from the start of the edge, normal field
uniform isampler2D rows;       // of the patches at hand: first corner, and the bits of a number
uniform int size;              // corners of a patch
uniform int columns;           // control vectors of a patch

const float GRID = 1.0 / 1073741824.0;
// An edge that is shorter is known to fewer digits than its normals need.
const float LEAST_EDGE = 2e4 * GRID;

vec3 difference(int from, int to) {
    return vec3(texelFetch(positions, place(to), 0).xyz - texelFetch(positions, place(from), 0).xyz) * GRID;
}

vec3 normal_at(int i) {
    return texelFetch(normals, place(i), 0).xyz;
}

vec3 vector_at(int row, int i) {
    return texelFetch(vectors, place(row * VECTORS + i), 0).xyz;
}

ivec4 side_at(int side) {
    return texelFetch(sides, place(side), 0);
}

int feature_at(int side) {
    return texelFetch(features, place(side), 0).x;
}

int corner_at(int corner) {
    return texelFetch(corners, place(corner), 0).x;
}

int first_corner(int row) {
    return texelFetch(rows, place(row), 0).x;
}

float shape_of(int row) {
    return intBitsToFloat(texelFetch(rows, place(row), 0).y);
}

int vertex_of(int corner) {
    int code = corner_at(corner);
    ivec4 ends = side_at(code >> 1);
    return (code & 1) == 0 ? ends.x : ends.y;
}

vec3 corner_normal(int corner) {
    int code = corner_at(corner);
    ivec4 ends = side_at(code >> 1);
    return normal_at((code & 1) == 0 ? ends.z : ends.w);
}

vec3 corner_point(int from, int corner) {
    return difference(vertex_of(from), vertex_of(corner));
}

mat3x4 bezier(vec3 a, vec3 b, vec3 c, vec3 d) {
    return transpose(mat4x3(a, b, c, d));
}

vec3 bezier_point(mat3x4 points, int i) {
    return vec3(points[0][i], points[1][i], points[2][i]);
}

mat3x4 edge_texels(int side, int first) {
    int at = side * EDGE_TEXELS + first;
    return mat3x4(texelFetch(edges, place(at), 0), texelFetch(edges, place(at + 1), 0), texelFetch(edges, place(at + 2), 0));
}

// The first `count` Bezier points the other way round.
mat3x4 reversed(mat3x4 points, int count) {
    vec3 none = vec3(0.0), a = bezier_point(points, 0), b = bezier_point(points, 1), c = bezier_point(points, 2);
    return count == 3 ? bezier(c, b, a, none) : bezier(bezier_point(points, 3), c, b, a);
}

// Curve of a half-edge in its own direction, from its start.
mat3x4 side_curve(int corner) {
    int code = corner_at(corner);
    mat3x4 curve = edge_texels(code >> 1, 0);
    if ((code & 1) == 0) {
        return curve;
    }
    vec3 end = bezier_point(curve, CURVE_POINTS - 1);
    mat3x4 back = reversed(curve, CURVE_POINTS);
    for (int i = 0; i < CURVE_POINTS; i++) {
        back[0][i] -= end.x;
        back[1][i] -= end.y;
        back[2][i] -= end.z;
    }
    return back;
}

// Normal field of a half-edge in its own direction.
mat3x4 side_field(int corner) {
    int code = corner_at(corner);
    mat3x4 field = edge_texels(code >> 1, CURVE_TEXELS);
    return (code & 1) == 0 ? field : reversed(field, FIELD_POINTS);
}

// Whether a curve was made: single precision is not enough for those of the shortest edges.
bool is_made(mat3x4 curve) {
    return bezier_point(curve, CURVE_POINTS - 1) != vec3(0.0);
}

bool sides_made(int first) {
    for (int k = 0; k < size; k++) {
        if (!is_made(side_curve(first + k))) {
            return false;
        }
    }
    return true;
}

void store_edge(mat3x4 curve, mat3x4 field, out vec4 texels[EDGE_TEXELS]) {
    for (int i = 0; i < 3; i++) {
        texels[i] = curve[i];
        texels[3 + i] = field[i];
    }
}
