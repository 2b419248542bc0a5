// Entry of the programs that make records, for devices with compute shaders: one invocation, one record.

layout(local_size_x = 64) in;
layout(std430, binding = 0) writeonly buffer Results { vec4 results[]; };

uniform int first_item;
uniform int items;

void main() {
    int i = int(gl_GlobalInvocationID.x + gl_GlobalInvocationID.y * gl_NumWorkGroups.x * 64u);
    if (i < items) {
        vec4 texels[TEXELS];
        RECORD(first_item + i, texels);
        for (int j = 0; j < TEXELS; j++) {
            results[i * TEXELS + j] = texels[j];
        }
    }
}
