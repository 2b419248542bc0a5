// Entry for devices with compute shaders: one invocation, one tile. LENGTH numbers a sample, samples within patches.

layout(local_size_x = GROUP) in;
layout(std430, binding = 0) writeonly buffer Results { float results[]; };

void store(int first, vec3 value) {
    results[first] = value.x;
    results[first + 1] = value.y;
    results[first + 2] = value.z;
}

void main() {
    int first_sample = int(gl_GlobalInvocationID.x) * SAMPLES;
    int first_patch = int(gl_WorkGroupID.y) * PATCHES;
    vec3 values[TILE * ORDERS];
    matrix_product(first_patch, first_sample, values);
    for (int p = 0; p < PATCHES; p++) {
        for (int s = 0; s < SAMPLES; s++) {
            if (first_patch + p < patches && first_sample + s < samples) {
                int from = (p * SAMPLES + s) * ORDERS;
                int to = ((first_patch + p) * samples + first_sample + s) * LENGTH;
#if defined(NORMALS)
                store(to, scale * values[from]);
                store(to + 3, cross_normals(values[from + 1], values[from + 2]));
#elif defined(UNIT)
                store(to, unit_normal(values[from]));
#else
                store(to, scale * values[from]);
#endif
            }
        }
    }
}
