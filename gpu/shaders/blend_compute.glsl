// Entry for devices with compute shaders: one invocation, SAMPLES samples of one patch.

layout(local_size_x = GROUP) in;
layout(std430, binding = 0) writeonly buffer Results { float results[]; };

void store(int first, vec3 value) {
    results[first] = value.x;
    results[first + 1] = value.y;
    results[first + 2] = value.z;
}

void main() {
    int tiles = (samples + SAMPLES - 1) / SAMPLES;
    int index = int(gl_GlobalInvocationID.x);
    int row = index / tiles;
    int first_sample = index % tiles * SAMPLES;
    if (row >= patches) {
        return;
    }
    vec3 jets[3 * SAMPLES];
    float reach[SAMPLES];
    face_jets(row, first_sample, jets, reach);
    for (int s = 0; s < SAMPLES; s++) {
        if (first_sample + s < samples) {
            int to = (row * samples + first_sample + s) * 6;
            store(to, jets[3 * s]);
            store(to + 3, cross_normals(jets[3 * s + 1], jets[3 * s + 2], reach[s]));
        }
    }
}
