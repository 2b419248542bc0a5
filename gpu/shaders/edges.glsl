// Twins of core/edges.py, for edges without a sharp feature, where no fallback serves.

#include "inputs"

vec3 smooth_tangents(vec3 along, vec3 normal, vec3 bending) {
    return unit_rows(along * dot(normal, bending) - bending * dot(normal, along));
}

vec3 projected_tangents(vec3 along, vec3 normal) {
    return unit_rows(along - dot(along, normal) * normal);
}

float tangent_lengths(vec3 chord, vec3 tangent) {
    float reach = length(chord);
#if defined(CHORD)
    return reach;
#else
    return 2.0 * reach / (1.0 + dot(tangent, chord) / reach);
#endif
}

mat3x4 edge_curves(vec3 chord, vec3 start_tangent, vec3 end_tangent) {
    vec3 first = tangent_lengths(chord, start_tangent) * start_tangent / 3.0;
    vec3 last = chord - tangent_lengths(chord, end_tangent) * end_tangent / 3.0;
    return bezier(vec3(0.0), first, last, chord);
}

vec3 _field(vec3 derivative, vec3 normal, vec3 along) {
    return normal * dot(derivative, along) - along * dot(derivative, normal);
}

// The numpy twin multiplies by the chord twice more; the length of the field does not matter.
mat3x4 normal_fields(mat3x4 curve, vec3 start_normal, vec3 end_normal) {
    vec3 p1 = bezier_point(curve, 1), p2 = bezier_point(curve, 2), chord = bezier_point(curve, 3);
    float reach = length(chord);
    vec3 along = chord / reach, c0 = 3.0 * p1 / reach, c1 = 3.0 * (p2 - p1) / reach, c2 = 3.0 * (chord - p2) / reach;
    return bezier(
        _field(c0, start_normal, along),
        (_field(c0, end_normal, along) + 2.0 * _field(c1, start_normal, along)) / 3.0,
        (2.0 * _field(c1, end_normal, along) + _field(c2, start_normal, along)) / 3.0,
        _field(c2, end_normal, along)
    );
}
