// Records in textures, found by their number: rows of WIDTH texels, one after the other. And small functions on vectors.

ivec2 place(int i) {
    return ivec2(i & (WIDTH - 1), i >> WIDTH_BITS);
}

// Unit vector, or zero.
vec3 unit_rows(vec3 value) {
    float square = dot(value, value);
    return square > 0.0 ? value * inversesqrt(square) : vec3(0.0);
}

// Cubic Bernstein polynomials at t.
vec4 bernstein_basis(float t) {
    float s = 1.0 - t;
    return vec4(s * s * s, 3.0 * t * s * s, 3.0 * t * t * s, t * t * t);
}

// Their derivatives.
vec4 bernstein_slopes(float t) {
    float s = 1.0 - t;
    return 3.0 * vec4(-s * s, s * (s - 2.0 * t), t * (2.0 * s - t), t * t);
}
