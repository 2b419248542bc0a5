// Twins of core/schemes/gregory.py: edges, then for each side of a patch its cross tangent, then control vectors.

#include "edges"
#include "cross_tangents"

uniform sampler2D targets;     // for each patch where its center goes, and whether that is sure
uniform sampler2D made;        // SIDE_TEXELS a side: what its field is made of, and control vectors
uniform sampler2D centers;     // for each patch what moves its center there, and whether it could be built
uniform vec2 speed_slopes;     // derivative of side_speed at 0 and 1
uniform float center_row[9];   // weights at the center: of six blocks of columns, and of T(1/2), T(0), T(1)

// Where the control vectors of a side begin among its texels: corner, legs, T'(0), T'(1) and T(1/2). The fourth number
// of the texel FLAG tells whether the side could be built.
#if defined(PRECISE) || defined(SMOOTH)
const int VECTORS_AT = 5, FLAG = 4;
#else
const int VECTORS_AT = 11, FLAG = 9;
#endif
// Shares of what they are measured by below which single precision does not tell where vectors point.
const float UNSURE = 1e-4;

void edge_record(int side, out vec4 texels[EDGE_TEXELS]) {
    ivec4 ends = side_at(side);
    vec3 chord = difference(ends.x, ends.y);
    vec3 start_normal = normal_at(ends.z), end_normal = normal_at(ends.w);
    if (length(chord) < LEAST_EDGE) {
        store_edge(mat3x4(0.0), mat3x4(0.0), texels);
        return;
    }
    vec3 start_tangent, end_tangent;
    int row = feature_at(side);
    if (row < 0) {
        vec3 along = unit_rows(chord), bending = (start_normal + end_normal) / 2.0;
        start_tangent = smooth_tangents(along, start_normal, bending);
        end_tangent = smooth_tangents(along, end_normal, bending);
    } else {
        start_tangent = vector_at(row, 0);
        end_tangent = vector_at(row, 1);
        vec3 bending = vector_at(row, 2);
        if (bending != vec3(0.0)) {
            start_normal = end_normal = bending;
        }
    }
    mat3x4 curve = edge_curves(chord, start_tangent, end_tangent);
    store_edge(curve, normal_fields(curve, start_normal, end_normal), texels);
}

int around(int k) {
    return (k + size) % size;
}

vec3 first_leg(mat3x4 curve) {
    return bezier_point(curve, 1);
}

vec3 last_leg(mat3x4 curve) {
    return bezier_point(curve, 2) - bezier_point(curve, 3);
}

// Where the middle of a patch goes, from its first corner; `sure` where single precision tells.
vec3 center_point(int first, float bulge, out bool sure) {
    vec3 middle = vec3(0.0), total = vec3(0.0), area = vec3(0.0);
    for (int k = 0; k < size; k++) {
        middle += corner_point(first, first + k) / float(size);
        total += corner_normal(first + k);
    }
    float reach = 0.0, square = 0.0;
    for (int k = 0; k < size; k++) {
        vec3 offset = middle - corner_point(first, first + k);
        area += cross(offset, middle - corner_point(first, first + around(k + 1)));
        reach += length(offset) / float(size);
        square += dot(offset, offset);
    }
    float weak = length(total) - 0.2 * float(size);
    sure = length(area) > UNSURE * square && abs(weak) > UNSURE;
    area = unit_rows(area);
    vec3 mean = weak < 0.0 ? area : unit_rows(total);
    vec3 axis = unit_rows(mean + pow(max(dot(mean, area), 0.0), 4.0) * area);
    float height = bulge * reach;
    for (int k = 0; k < size; k++) {
        vec3 offset = middle - corner_point(first, first + k), normal = corner_normal(first + k);
        height -= dot(offset, normal + axis) / max(1.0 + dot(normal, axis), 0.5) / float(size);
    }
    return middle + height * axis;
}

#if defined(PRECISE) || defined(SMOOTH)

// T(0) and T(1) as the neighboring edges ask for them.
Side patch_sides(int first, int k) {
    vec3 start = 3.0 * last_leg(side_curve(first + around(k - 1)));
    vec3 end = 3.0 * first_leg(side_curve(first + around(k + 1)));
    return Side(side_field(first + k), start, end, 0.0);
}

// Fullness from the distance of the center point `target`, which is given from the first corner.
Side precise_tangent(Side side, int first, int k, vec3 target) {
    if (size == 3) {
        return side;
    }
    vec3 middle, unused;
    _blend_with_slope(side, 0.5, middle, unused);
    mat3x4 curve = side_curve(first + k);
    vec3 reach = target - corner_point(first, first + k) - bernstein_basis(0.5) * curve;
    float far = length(reach), speed = length(middle);
    float cosine = max(far * speed > 0.0 ? dot(reach, middle) / (far * speed) : 0.0, 0.5);
    float turn = sin(3.14159265358979 / float(size));
    float ratio = speed > 0.0 ? far / (speed * cosine) : 0.0;
    side.gain = clamp((size == 4 ? 0.15 : 0.3) * (4.0 * turn * turn * ratio - 1.0), -0.5, 1.0);
    return side;
}

// Fullness from what the projection takes away in the middle.
Side smooth_tangent(Side side, float bulge) {
    vec3 middle, unused;
    _blend_with_slope(side, 0.5, middle, unused);
    float mean = (length(side.start) + length(side.end)) / 2.0;
    float kept = mean > 0.0 ? dot(middle, middle) / (mean * mean) : 0.0;
    side.gain = (size <= 4 ? 0.5 : 1.0) * clamp((1.0 - kept) / 2.0, 0.0, 0.2) + bulge;
    return side;
}

void store_side(Side side, bool sure, out vec4 texels[SIDE_TEXELS]) {
    for (int i = 0; i < 3; i++) {
        texels[i] = side.field[i];
    }
    texels[3] = vec4(side.start, side.gain);
    texels[4] = vec4(side.end, sure ? 1.0 : 0.0);
}

Side cross_tangents(int row, int first, int k, out bool sure) {
    Side side = patch_sides(first, k);
#if defined(PRECISE)
    vec4 target = texelFetch(targets, place(row), 0);
    sure = target.w != 0.0;
    return precise_tangent(side, first, k, target.xyz);
#else
    sure = true;
    return smooth_tangent(side, shape_of(row));
#endif
}

#else

// Normal of side k: marked, or the mean of its ends'.
vec3 side_normals(int first, int k) {
    int row = feature_at(corner_at(first + k) >> 1);
#if VECTORS > 3
    if (row >= 0 && vector_at(row, 3) != vec3(0.0)) {
        return vector_at(row, 3);
    }
#endif
    return (corner_normal(first + k) + corner_normal(first + around(k + 1))) / 2.0;
}

// Equation (12): unit mean of the unit corner crosses.
vec3 polygon_normal(int first) {
    vec3 total = vec3(0.0);
    for (int k = 0; k < size; k++) {
        int here = first + k;
        total += unit_rows(
            cross(corner_point(here, first + around(k + 1)), corner_point(here, first + around(k - 1)))
        );
    }
    return unit_rows(total);
}

// Equations (8) and (9): n_int through the neighboring sides' normals, as a quadratic.
mat3x4 guides_of(int first, int k, float alpha) {
    vec3 before = side_normals(first, around(k - 1)), after = side_normals(first, around(k + 1));
#if defined(LINEAR)
    return bezier(before, (before + after) / 2.0, after, vec3(0.0));
#else
    return bezier(before, 2.0 * alpha * polygon_normal(first) - (before + after) / 2.0, after, vec3(0.0));
#endif
}

// Whether the chord or its direction vanishes nowhere, as far as single precision tells.
bool is_regular(Side side) {
    vec2 least = vec2(1e30), most = vec2(0.0);
    for (int i = 0; i < 17; i++) {
        vec3 x, x_slope, direction, slope, n, n_slope;
        _direction(side, float(i) / 16.0, x, x_slope, direction, slope, n, n_slope);
        vec2 sizes = vec2(dot(x, x), dot(direction, direction));
        least = min(least, sizes);
        most = max(most, sizes);
    }
    return all(greaterThan(least, UNSURE * UNSURE * most));
}

void store_side(Side side, bool sure, out vec4 texels[SIDE_TEXELS]) {
    for (int i = 0; i < 3; i++) {
        texels[i] = side.chord[i];
        texels[3 + i] = side.field[i];
        texels[6 + i] = side.guides[i];
    }
    texels[9] = vec4(side.first, sure ? 1.0 : 0.0);
    texels[10] = vec4(side.last, 0.0);
}

Side cross_tangents(int row, int first, int k, out bool sure) {
    int here = first + k;
    vec3 before = corner_point(here, first + around(k - 1)), after = corner_point(here, first + around(k + 2));
    mat3x4 line = bezier(before, mix(before, after, 1.0 / 3.0), mix(before, after, 2.0 / 3.0), after);
    Side side = Side(line - side_curve(here), side_field(here), guides_of(first, k, shape_of(row)), vec3(0.0), vec3(0.0));
    sure = is_regular(side);
    vec3 start = fields(side, 0.0), end = fields(side, 1.0);
    side.first = 3.0 * last_leg(side_curve(first + around(k - 1))) - start;
    side.last = 3.0 * first_leg(side_curve(first + around(k + 1))) - end;
    return side;
}

#endif

void target_record(int row, out vec4 texels[1]) {
    bool sure;
    vec3 target = center_point(first_corner(row), shape_of(row), sure);
    texels[0] = vec4(target, sure ? 1.0 : 0.0);
}

// The tables take T(0) and T(1) for what the neighboring edges ask for. They are, where those are perpendicular to the
// field.
bool has_ends(Side side, int first, int k) {
    vec3 start = 3.0 * last_leg(side_curve(first + around(k - 1)));
    vec3 end = 3.0 * first_leg(side_curve(first + around(k + 1)));
    float off = length(fields(side, 0.0) - start) + length(fields(side, 1.0) - end);
    return off <= UNSURE * (length(start) + length(end));
}

void side_record(int item, out vec4 texels[SIDE_TEXELS]) {
    int row = item / size, k = item % size, first = first_corner(row);
    mat3x4 curve = side_curve(first + k);
    bool sure;
    Side side = cross_tangents(row, first, k, sure);
    sure = sure && is_made(curve) && has_ends(side, first, k);
    store_side(side, sure, texels);
    texels[VECTORS_AT] = vec4(corner_point(first, first + k), 0.0);
    texels[VECTORS_AT + 1] = vec4(first_leg(curve), 0.0);
    texels[VECTORS_AT + 2] = vec4(last_leg(curve), 0.0);
    for (int end = 0; end < 2; end++) {
        vec3 value, slope;
        field_derivatives(side, float(end), value, slope);
#if defined(PRECISE)
        slope += value * speed_slopes[end];  // T' = s F' + s' F, and s = 1 at the ends
#endif
        texels[VECTORS_AT + 3 + end] = vec4(slope, 0.0);
    }
#if defined(PRECISE)
    texels[VECTORS_AT + 5] = vec4(fields(side, 0.5), 0.0);
#endif
}

vec4 side_texel(int row, int k, int i) {
    return texelFetch(made, place((row * size + k) * SIDE_TEXELS + i), 0);
}

void center_record(int row, out vec4 texels[1]) {
    bool built = true;
    vec3 total = vec3(0.0);
    for (int k = 0; k < size; k++) {
        built = built && side_texel(row, k, FLAG).w != 0.0;
#if defined(PRECISE)
        for (int block = 0; block < 6; block++) {
            total += center_row[block] * side_texel(row, k, VECTORS_AT + block).xyz;
        }
        total += center_row[6] * side_texel(row, k, VECTORS_AT + 5).xyz;
        total += 3.0 * center_row[7] * side_texel(row, around(k - 1), VECTORS_AT + 2).xyz;
        total += 3.0 * center_row[8] * side_texel(row, around(k + 1), VECTORS_AT + 1).xyz;
#endif
    }
#if defined(PRECISE)
    total = texelFetch(targets, place(row), 0).xyz - total;
#endif
    texels[0] = vec4(total, built ? 1.0 : 0.0);
}

bool is_built(int row, int first) {
    return texelFetch(centers, place(row), 0).w != 0.0;
}

// Block by block, side by side; then, for `precise`, the center.
vec3 column(int row, int first, int index) {
    bool last = index == columns - 1 && columns % size != 0;
    int at = (row * size + index % size) * SIDE_TEXELS + VECTORS_AT + index / size;
    return last ? texelFetch(centers, place(row), 0).xyz : texelFetch(made, place(at), 0).xyz;
}

vec3 normal_column(int row, int first, int index) {
    return corner_normal(first + index);
}
