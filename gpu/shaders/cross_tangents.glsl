// Cross tangents, the side fields of gregory; twins of core/schemes/cross_tangents.py. What a field is made of, `Side`,
// stands in texels behind a patch's control vectors, SIDE_STRIDE for each side.

#include "records"

// y across the normal, and its derivative.
void project_with_slope(inout vec3 y, inout vec3 y_slope, vec3 normal, vec3 normal_slope) {
    float square = dot(normal, normal);
    float inverse = square > 0.0 ? 1.0 / square : 0.0;
    float q = dot(normal, y) * inverse;
    float numerator = dot(normal_slope, y) + dot(normal, y_slope) - 2.0 * q * dot(normal, normal_slope);
    y -= q * normal;
    y_slope -= numerator * inverse * normal + q * normal_slope;
}

#if defined(PRECISE) || defined(SMOOTH)

// T = (1 + K b(t)) Y, Y the part across the normal of h(t) T(0) + (1 - h(t)) T(1).
struct Side {
    mat3x4 field;
    vec3 start, end;
    float gain;
};

Side to_side(mat3x4 field, vec4 start, vec3 end) {
    return Side(field, start.xyz, end, start.w);
}

// h and h'.
vec2 _step(float t) {
#if defined(PRECISE)
    return vec2(1.0 - t, -1.0);
#else
    const float share = 0.75;
    return vec2(
        (1.0 - t) * ((1.0 - share) + share * (1.0 - t) * (1.0 + 2.0 * t)), -(1.0 - share) - 6.0 * share * t * (1.0 - t)
    );
#endif
}

// 1 + K b and its derivative.
vec2 _fullness(float gain, float t) {
    float b = 4.0 * t * (1.0 - t), b_slope = 4.0 - 8.0 * t;
#if defined(PRECISE)
    return vec2(1.0 + gain * b, gain * b_slope);
#else
    return vec2(1.0 + gain * b * b, gain * (2.0 * b * b_slope));
#endif
}

void _blend_with_slope(Side side, float t, out vec3 y, out vec3 y_slope) {
    vec2 h = _step(t);
    y = side.end + h.x * (side.start - side.end);
    y_slope = h.y * (side.start - side.end);
    project_with_slope(y, y_slope, bernstein_basis(t) * side.field, bernstein_slopes(t) * side.field);
}

void field_derivatives(Side side, float t, out vec3 value, out vec3 slope) {
    _blend_with_slope(side, t, value, slope);
    vec2 factor = _fullness(side.gain, t);
    slope = factor.x * slope + factor.y * value;
    value *= factor.x;
}

#else

// The paper's: the chord from the side to the line across it, turned to be perpendicular to the normal; the corrections
// restore the required ends.
struct Side {
    mat3x4 chord, field, guides;
    vec3 first, last;
};

void _direction(
    Side side, float t, out vec3 x, out vec3 x_slope, out vec3 direction, out vec3 slope, out vec3 n, out vec3 n_slope
) {
    vec4 basis = bernstein_basis(t), slopes = bernstein_slopes(t);
    x = basis * side.chord;
    x_slope = slopes * side.chord;
    n = basis * side.field;
    n_slope = slopes * side.field;
    float s = 1.0 - t;
    vec3 guide = vec4(s * s, 2.0 * t * s, t * t, 0.0) * side.guides;
    vec3 guide_slope = 2.0 * vec4(-s, s - t, t, 0.0) * side.guides;
    float a = dot(guide, n), b = dot(x, n);
    float a_slope = dot(guide_slope, n) + dot(guide, n_slope), b_slope = dot(x_slope, n) + dot(x, n_slope);
    direction = x * a - guide * b;
    slope = x_slope * a + x * a_slope - guide_slope * b - guide * b_slope;
}

void field_derivatives(Side side, float t, out vec3 value, out vec3 slope) {
    vec3 x, x_slope, direction, direction_slope, n, n_slope;
    _direction(side, t, x, x_slope, direction, direction_slope, n, n_slope);
    float square = dot(x, x), size = dot(direction, direction);
    float ratio = square > 0.0 && size > 0.0 ? sqrt(square / size) : 0.0;
    float ratio_slope = ratio > 0.0 ? ratio * (dot(x, x_slope) / square - dot(direction, direction_slope) / size) : 0.0;
    vec3 part = mix(side.first, side.last, t), part_slope = side.last - side.first;
    project_with_slope(part, part_slope, n, n_slope);
    value = ratio * direction + part;
    slope = ratio * direction_slope + ratio_slope * direction + part_slope;
}

#endif

vec3 fields(Side side, float t) {
    vec3 value, slope;
    field_derivatives(side, t, value, slope);
    return value;
}
