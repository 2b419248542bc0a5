// Control vectors times basis tables, for SAMPLES samples of PATCHES patches; the CPU's twin is core/evaluate.py.
// Both operands lie in textures of four columns a texel, the last ones filled up with zeros. ORDERS is 3 where value and
// both derivatives are wanted, 1 for values alone; what comes out of a sample has LENGTH numbers.

#include "controls"

uniform sampler2D basis;     // (sample, block * ORDERS + order), then two rows for each side field
uniform isampler2D rows;     // of the patches among the controls, where they are chosen
uniform int chosen;
uniform ivec2 layout_of;     // texels of a patch among the controls, and the first of them
uniform int blocks;          // blocks of four columns
uniform int patches;
uniform int samples;
uniform float scale;         // of positions

const int TILE = PATCHES * SAMPLES;
// Squared sine below which two derivatives in single precision give no good normal: the CPU looks at those again.
const float PARALLEL = 1e-4;
// A derivative that is shorter than this share of the other is what larger vectors leave over when they cancel.
const float SHORT = 1e-3;

int first_texel(int row_of) {
    int i = min(row_of, patches - 1);
    int row = chosen != 0 ? texelFetch(rows, place(i), 0).x : i;
    return row * layout_of.x + layout_of.y;
}

#if defined(FIELDS)
uniform int sides;

// Adds what the side fields give: weight times field, and by the chain rule its derivatives.
void field_sum(int first[PATCHES], int first_sample, inout vec3 values[TILE * ORDERS]) {
    for (int k = 0; k < sides; k++) {
        vec4 weights[SAMPLES], slopes[SAMPLES];
        for (int s = 0; s < SAMPLES; s++) {
            int at = min(first_sample + s, samples - 1), row = blocks * ORDERS + 2 * k;
            weights[s] = texelFetch(basis, ivec2(at, row), 0);
            slopes[s] = texelFetch(basis, ivec2(at, row + 1), 0);
        }
        for (int p = 0; p < PATCHES; p++) {
            Side side = read_side(first[p] + 3 * blocks + k * SIDE_STRIDE);
            for (int s = 0; s < SAMPLES; s++) {
                int to = (p * SAMPLES + s) * ORDERS;
#if ORDERS == 1
                values[to] += weights[s].x * fields(side, weights[s].w);
#else
                vec3 value, slope;
                field_derivatives(side, weights[s].w, value, slope);
                values[to] += weights[s].x * value;
                values[to + 1] += weights[s].y * value + slopes[s].x * slope;
                values[to + 2] += weights[s].z * value + slopes[s].y * slope;
#endif
            }
        }
    }
}
#endif

// Adds up all columns; patches and samples beyond the last repeat it.
void matrix_product(int first_patch, int first_sample, out vec3 values[TILE * ORDERS]) {
    int first[PATCHES];
    for (int p = 0; p < PATCHES; p++) {
        first[p] = first_texel(first_patch + p);
    }
    for (int i = 0; i < TILE * ORDERS; i++) {
        values[i] = vec3(0.0);
    }
    for (int block = 0; block < blocks; block++) {
        vec4 tables[SAMPLES * ORDERS];
        for (int s = 0; s < SAMPLES; s++) {
            for (int order = 0; order < ORDERS; order++) {
                ivec2 at = ivec2(min(first_sample + s, samples - 1), block * ORDERS + order);
                tables[s * ORDERS + order] = texelFetch(basis, at, 0);
            }
        }
        for (int p = 0; p < PATCHES; p++) {
            mat3x4 columns = control_texels(first[p] + 3 * block);
            for (int i = 0; i < SAMPLES * ORDERS; i++) {
                values[p * SAMPLES * ORDERS + i] += tables[i] * columns;
            }
        }
    }
#if defined(FIELDS)
    field_sum(first, first_sample, values);
#endif
}

// Unit vector, or zero for what is too short to have a direction.
vec3 unit_normal(vec3 value) {
    float square = dot(value, value);
    return square > 1e-8 ? value * inversesqrt(square) : vec3(0.0);
}

// Unit cross product, or zero where the two are parallel, or not numbers.
vec3 cross_normals(vec3 a, vec3 b) {
    float size = max(max(abs(a.x), abs(a.y)), abs(a.z)), other = max(max(abs(b.x), abs(b.y)), abs(b.z));
    if (!(min(size, other) > SHORT * max(size, other))) {
        return vec3(0.0);
    }
    a /= size;
    b /= other;
    vec3 normal = cross(a, b);
    float square = dot(normal, normal);
    return square > PARALLEL * dot(a, a) * dot(b, b) ? normal * inversesqrt(square) : vec3(0.0);
}
