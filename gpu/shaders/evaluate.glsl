// Control vectors times basis tables, for SAMPLES samples of PATCHES patches; the CPU's twin is core/evaluate.py.
// Both operands lie in textures of four columns a texel, the last ones filled up with zeros. ORDERS is 3 where value and
// both derivatives are wanted, 1 for values alone; what comes out of a sample has LENGTH numbers.

uniform sampler2D basis;     // (sample, block * ORDERS + order)
uniform sampler2D controls;  // (component * blocks + block, patch)
uniform int blocks;          // blocks of four columns
uniform int patches;
uniform int samples;

const int TILE = PATCHES * SAMPLES;
// Squared sine below which two derivatives in single precision give no good normal: the CPU looks at those again.
const float PARALLEL = 1e-4;

vec3 column_sum(vec4 table, vec4 x, vec4 y, vec4 z) {
    return vec3(dot(table, x), dot(table, y), dot(table, z));
}

// Adds up all columns; patches and samples beyond the last repeat it.
void matrix_product(int first_patch, int first_sample, out vec3 values[TILE * ORDERS]) {
    for (int i = 0; i < TILE * ORDERS; i++) {
        values[i] = vec3(0.0);
    }
    for (int block = 0; block < blocks; block++) {
        vec4 tables[SAMPLES * ORDERS];
        for (int s = 0; s < SAMPLES; s++) {
            for (int order = 0; order < ORDERS; order++) {
                ivec2 place = ivec2(min(first_sample + s, samples - 1), block * ORDERS + order);
                tables[s * ORDERS + order] = texelFetch(basis, place, 0);
            }
        }
        for (int p = 0; p < PATCHES; p++) {
            int row = min(first_patch + p, patches - 1);
            vec4 x = texelFetch(controls, ivec2(block, row), 0);
            vec4 y = texelFetch(controls, ivec2(blocks + block, row), 0);
            vec4 z = texelFetch(controls, ivec2(2 * blocks + block, row), 0);
            for (int i = 0; i < SAMPLES * ORDERS; i++) {
                values[p * SAMPLES * ORDERS + i] += column_sum(tables[i], x, y, z);
            }
        }
    }
}

// Unit vector, or zero for what is too short to have a direction.
vec3 unit_rows(vec3 value) {
    float square = dot(value, value);
    return square > 1e-24 ? value * inversesqrt(square) : vec3(0.0);
}

// Unit cross product, or zero where the two are parallel, or not numbers.
vec3 cross_normals(vec3 a, vec3 b) {
    vec3 normal = cross(a, b);
    float square = dot(normal, normal);
    return square > PARALLEL * dot(a, a) * dot(b, b) ? normal * inversesqrt(square) : vec3(0.0);
}
