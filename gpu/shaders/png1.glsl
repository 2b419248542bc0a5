// Twins of core/schemes/png1.py. The second half of an edge's texels are the legs of W, its curve's turned a quarter.

#include "edges"

uniform isampler2D links;   // of a side: vertices across its edge, left and right, or -1; its half-edge; whether its
                            // normals stay exact
uniform sampler2D fields;   // FIELD_TEXELS a side: normal field, and the middle of the quadratic one
uniform sampler2D made;     // SIDE_TEXELS a side of a patch: its control points

ivec4 links_of(int side) {
    return texelFetch(links, place(side), 0);
}

// Unit normal of the triangle on one side of an edge, zero where none counts.
vec3 facing_across(int from, int to, int across) {
    return across < 0 ? vec3(0.0) : unit_rows(cross(difference(from, to), difference(from, across)));
}

// Unit normal of the triangle with a first corner.
vec3 facing_of(int first) {
    return unit_rows(cross(corner_point(first, first + 1), corner_point(first, first + 2)));
}

vec3 middle_planes(int side, int row) {
    if (row >= 0 && vector_at(row, 2) != vec3(0.0)) {
        return vector_at(row, 2);
    }
    ivec4 ends = side_at(side), across = links_of(side);
    return facing_across(ends.x, ends.y, across.x) + facing_across(ends.y, ends.x, across.y);
}

mat3x4 chord_curves(vec3 chord, vec3 start_tangent, vec3 end_tangent) {
    float third = length(chord) / 3.0;
    return bezier(vec3(0.0), third * start_tangent, chord - third * end_tangent, chord);
}

vec3 _turned(vec3 leg, vec3 normal) {
    return length(leg) * unit_rows(cross(normal, leg));
}

vec3 leg_of(mat3x4 curve, int i) {
    return bezier_point(curve, i + 1) - bezier_point(curve, i);
}

// Whether single precision turns a leg about a normal.
bool can_turn(vec3 leg, vec3 normal) {
    return length(cross(leg, normal)) > 1e-4 * length(leg) * length(normal);
}

void edge_record(int side, out vec4 texels[EDGE_TEXELS]) {
    ivec4 ends = side_at(side);
    vec3 chord = difference(ends.x, ends.y), along = unit_rows(chord);
    vec3 start_normal = normal_at(ends.z), end_normal = normal_at(ends.w);
    int row = feature_at(side);
    vec3 start_tangent = row < 0 ? projected_tangents(along, start_normal) : vector_at(row, 0);
    vec3 end_tangent = row < 0 ? projected_tangents(along, end_normal) : vector_at(row, 1);
    mat3x4 curve = chord_curves(chord, start_tangent, end_tangent);
    vec3 first = leg_of(curve, 0), inner = leg_of(curve, 1), last = leg_of(curve, 2), middle = middle_planes(side, row);
    bool sure = row < 0 || vector_at(row, 3).y == 0.0;
    if (sure && length(chord) >= LEAST_EDGE && can_turn(first, start_normal) && can_turn(last, end_normal)) {
        store_edge(
            curve, bezier(_turned(first, start_normal), _turned(inner, middle), _turned(last, end_normal), vec3(0.0)), texels
        );
    } else {
        store_edge(mat3x4(0.0), mat3x4(0.0), texels);
    }
}

// Legs of W of a half-edge, to the left of its own direction.
mat3x4 side_turns(int corner) {
    int code = corner_at(corner);
    mat3x4 turns = edge_texels(code >> 1, CURVE_TEXELS);
    return (code & 1) == 0 ? turns : -1.0 * reversed(turns, 3);
}

// The lift along a half-edge.
vec3 lift_of(int first, int corner) {
    int row = feature_at(corner_at(corner) >> 1);
    if (row < 0) {
        return vec3(0.0);
    }
    return vector_at(row, 3).x * length(bezier_point(side_curve(corner), 3)) * facing_of(first);
}

// Parts of a vector along a leg and its quarter turn.
vec2 _parts(vec3 vector, vec3 leg, vec3 turn) {
    float square = dot(leg, leg);
    return vec2(dot(vector, leg), dot(vector, turn)) / (square == 0.0 ? 1.0 : square);
}

struct Side {
    mat3x4 curve, turns;
    vec2 red, blue;
};

Side side_of(int first, int k) {
    Side side;
    side.curve = side_curve(first + k);
    side.turns = side_turns(first + k);
    mat3x4 before = side_curve(first + (k + 2) % 3), after = side_curve(first + (k + 1) % 3);
    side.red = _parts(-leg_of(before, 2), leg_of(side.curve, 0), bezier_point(side.turns, 0));
    vec3 last = leg_of(side.curve, 2);
    side.blue = _parts(last + leg_of(after, 0), last, bezier_point(side.turns, 2));
    return side;
}

// --- normal fields ---

void product_cross(mat3x4 a, mat3x4 b, out vec3 result[5]) {
    vec3 a0 = bezier_point(a, 0), a1 = bezier_point(a, 1), a2 = bezier_point(a, 2);
    vec3 b0 = bezier_point(b, 0), b1 = bezier_point(b, 1), b2 = bezier_point(b, 2);
    result[0] = cross(a0, b0);
    result[1] = (cross(a0, b1) + cross(a1, b0)) / 2.0;
    result[2] = (cross(a0, b2) + 4.0 * cross(a1, b1) + cross(a2, b0)) / 6.0;
    result[3] = (cross(a1, b2) + cross(a2, b1)) / 2.0;
    result[4] = cross(a2, b2);
}

mat3x4 legs_of(mat3x4 curve) {
    return bezier(leg_of(curve, 0), leg_of(curve, 1), leg_of(curve, 2), vec3(0.0));
}

float binomial(int n, int k) {
    float result = 1.0;
    for (int i = 1; i <= k; i++) {
        result *= float(n + 1 - i) / float(i);
    }
    return result;
}

// Bezier points of the same polynomial of degree 4 or 2 at a higher degree, up to 6.
void elevated(vec3 points[5], int degree, int higher, out vec3 result[7]) {
    for (int i = 0; i < 7; i++) {
        result[i] = vec3(0.0);
        for (int j = 0; j <= degree; j++) {
            int k = i - j;
            if (i <= higher && k >= 0 && k <= higher - degree) {
                result[i] += binomial(degree, j) * binomial(higher - degree, k) / binomial(higher, i) * points[j];
            }
        }
    }
}

// Where the derivative into the patch leaves the plane of C' and W.
void bent_field(int corner, int first, out vec3 result[7]) {
    Side side = side_of(first, corner - first);
    vec3 w0 = bezier_point(side.turns, 0), w1 = bezier_point(side.turns, 1), w2 = bezier_point(side.turns, 2);
    vec3 lift = lift_of(first, corner), slope[5];
    float a = side.red.y, b = side.blue.y;
    slope[0] = a * w0;
    slope[1] = a * w1 / 2.0 + lift / 2.0;
    slope[2] = (a * w2 + b * w0) / 6.0 + lift / 3.0;
    slope[3] = b * w1 / 2.0 + lift / 2.0;
    slope[4] = b * w2;
    for (int i = 0; i < 7; i++) {
        result[i] = vec3(0.0);
        for (int j = 0; j < 3; j++) {
            int k = i - j;
            if (k >= 0 && k <= 4) {
                float weight = binomial(2, j) * binomial(4, k) / binomial(6, i);
                result[i] += weight * cross(leg_of(side.curve, j), slope[k]);
            }
        }
    }
    if ((corner_at(corner) & 1) != 0) {
        for (int i = 0; i < 3; i++) {
            vec3 other = result[i];
            result[i] = result[6 - i];
            result[6 - i] = other;
        }
    }
}

vec3 bezier_at(vec3 points[7], int degree, float t) {
    vec3 result = points[0];
    float factor = 1.0;
    for (int i = 1; i <= degree; i++) {
        factor *= t * float(degree + 1 - i) / float(i);
        result = (1.0 - t) * result + factor * points[i];
    }
    return result;
}

// Whether a field keeps enough of its length for single precision to tell its direction: everywhere, and in the middle.
bvec2 is_safe(vec3 points[7], int degree) {
    float least = 1e30, most = 0.0;
    for (int i = 0; i < 9; i++) {
        float size = length(bezier_at(points, degree, float(i) / 8.0));
        least = min(least, size);
        most = max(most, size);
    }
    return greaterThan(vec2(least, length(bezier_at(points, degree, 0.5))), vec2(1e-3 * most));
}

void exact_field(int side, out vec3 points[7], out int degree) {
    int row = feature_at(side), corner = links_of(side).z;
    if (row >= 0 && vector_at(row, 3).x != 0.0) {
        degree = 6;
        bent_field(corner, 3 * (corner / 3), points);
        return;
    }
    degree = 4;
    vec3 found[5];
    product_cross(legs_of(edge_texels(side, 0)), edge_texels(side, CURVE_TEXELS), found);
    elevated(found, 4, 4, points);
}

void field_record(int side, out vec4 texels[FIELD_TEXELS]) {
    for (int i = 0; i < FIELD_TEXELS; i++) {
        texels[i] = vec4(0.0);
    }
    mat3x4 curve = edge_texels(side, 0);
    if (!is_made(curve)) {
        return;
    }
    vec3 exact[7], points[7], few[5];
    int degree;
    exact_field(side, exact, degree);
    float reach = length(bezier_point(curve, 3));
    for (int i = 0; i < 7; i++) {
        exact[i] /= reach * reach;
    }
    bvec2 safe = is_safe(exact, degree);
    ivec4 ends = side_at(side);
    vec3 start = normal_at(ends.z), end = normal_at(ends.w);
    vec3 middle = 2.0 * unit_rows(bezier_at(exact, degree, 0.5)) - (start + end) / 2.0;
    texels[FIELD_TEXELS - 1] = vec4(middle, safe.y ? 1.0 : 0.0);
    for (int i = 0; i < 5; i++) {
        few[i] = exact[i];
    }
#if defined(SMOOTH_NORMALS)
    if (links_of(side).w == 0) {
        few[0] = start;
        few[1] = middle;
        few[2] = end;
        degree = 2;
        safe.x = safe.y;
    }
#endif
    if (!safe.x) {
        return;
    }
    if (degree < 6) {
        elevated(few, degree, FIELD_POINTS - 1, points);
    } else {
        points = exact;
    }
    for (int i = 0; i < FIELD_POINTS; i++) {
        for (int j = 0; j < 3; j++) {
            texels[3 * (i / 4) + j][i % 4] = points[i][j];
        }
    }
}

// --- control vectors ---

// A side's control points: corner, q1, q2, then the other legs carried to its own.
void side_record(int item, out vec4 texels[SIDE_TEXELS]) {
    int row = item / 3, k = item % 3, first = first_corner(row);
    Side side = side_of(first, k);
    vec3 point = corner_point(first, first + k), lift = lift_of(first, first + k);
    ivec4 base = ivec4(0, 2, 1, 1);
    for (int i = 0; i < 3; i++) {
        texels[i] = vec4(point + bezier_point(side.curve, i), 0.0);
    }
    for (int i = 0; i < 4; i++) {
        vec2 parts = i == 0 || i == 3 ? side.blue : side.red;
        vec3 carried = parts.x * leg_of(side.curve, base[i]) + parts.y * bezier_point(side.turns, base[i]);
        texels[3 + i] = vec4(point + bezier_point(side.curve, base[i]) + carried + lift, 0.0);
    }
}

vec4 middle_of(int corner) {
    int side = corner_at(corner) >> 1;
    return texelFetch(fields, place((side + 1) * FIELD_TEXELS - 1), 0);
}

bool is_built(int row, int first) {
    bool built = sides_made(first);
#if defined(SMOOTH_NORMALS)
    for (int k = 0; k < 3; k++) {
        built = built && middle_of(first + k).w != 0.0;
    }
#endif
    return built;
}

vec3 column(int row, int first, int index) {
    return texelFetch(made, place((3 * row + index % 3) * SIDE_TEXELS + index / 3), 0).xyz;
}

vec3 normal_column(int row, int first, int index) {
    return index < 3 ? corner_normal(first + index) : middle_of(first + index - 3).xyz;
}
